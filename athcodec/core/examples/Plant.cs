// An .ath file for any engine in C#: a Plant fetches and decodes it, and Update writes its positions and normals for every drawn frame.
using System;
using Athcodec;

public sealed class Plant : IDisposable
{
    // Fetches bytes of the file, now or later, and hands them over on the thread that calls Update; fewer where the file ends.
    public delegate void Fetch(long offset, int size, Action<byte[]> arrived);

    readonly Fetch fetch;
    readonly AthUnpack unpack;
    readonly AthRange[] range = new AthRange[1];
    bool isFetching;

    public AthPlayer Player { get; private set; } // null: The front of the file is still to come.
    public string Failure { get; private set; } // what ended the download or the decoding; null: nothing
    public float[] Positions { get; private set; } // 3 numbers a vertex, scene units
    public float[] Normals { get; private set; }
    public float[] Bounds { get; } = new float[6]; // of Positions: least x, y, z, then largest x, y, z
    public float[] Uv { get; private set; } // 2 numbers a vertex; null: the file has none, or they are still to come
    public uint[] Triangles { get { return Player.Triangles; } } // empty: The file has no faces.

    public Plant(Fetch fetch, AthUnpack unpack)
    {
        this.fetch = fetch;
        this.unpack = unpack;
        FetchFront(1 << 14);
    }

    public void Dispose() { if (Player != null) Player.Dispose(); }

    void FetchFront(int size)
    {
        fetch(0, size, bytes => Try(() =>
        {
            int needed = checked((int)AthPlayer.Needed(bytes, bytes.Length));
            if (needed > 0 && bytes.Length == size) FetchFront(needed);
            else Open(new AthPlayer(bytes, bytes.Length)); // This throws if the file is cut off.
        }));
    }

    void Open(AthPlayer player)
    {
        Positions = new float[3 * player.Info.VertexCount];
        Normals = new float[3 * player.Info.VertexCount];
        Player = player;
        if (player.ArrayRanges(range) == 0) ReadUv();
    }

    void ReadUv()
    {
        AthArray uv = Player.Array("uv", unpack);
        if (uv != null && uv.Shape.Length == 2 && uv.Shape[0] == Player.Info.VertexCount && uv.Shape[1] == 2) Uv = uv.Floats();
    }

    // Writes Positions, Normals and Bounds, at the level that `distance` asks for or the best that is decoded, and prepares what comes next.
    // Returns the level; -1: nothing is there. fov: the vertical field of view in radians; height: in pixels. It allocates nothing
    // once all bytes are there.
    public int Update(double seconds, double distance, double fov, double height)
    {
        if (Player == null) return -1;
        int level = Player.LevelFor(distance, fov, height);
        FetchMissing(level);
        try
        {
            int shown = Player.Positions(0, seconds, AthWrap.Loop, level, Positions);
            Player.Ahead();
            Player.Normals(Positions, Normals);
            Player.Bounds(Positions, Bounds);
            return shown;
        }
        catch (AthException error) when (error.Result == AthResult.Missing)
        {
            return -1;
        }
    }

    // Asks for the first range that is missing: of level 0, of the named arrays, of the level.
    void FetchMissing(int level)
    {
        AthClip clip = Player.Clips[0];
        if (isFetching || (Player.Ranges(0, clip.FirstSegment, clip.LastSegment, range) == 0 && Player.ArrayRanges(range) == 0
            && Player.Ranges(level, clip.FirstSegment, clip.LastSegment, range) == 0)) return;
        Feed((long)range[0].Offset, checked((int)range[0].Size));
    }

    void Feed(long offset, int size)
    {
        isFetching = true; // until it is here
        fetch(offset, size, bytes => Try(() =>
        {
            if (bytes.Length < size) throw new InvalidOperationException("got " + bytes.Length + " bytes from " + offset + " on, expected " + size);
            isFetching = false;
            Player.Feed(bytes, bytes.Length, offset);
            if (Uv == null && Player.ArrayRanges(range) == 0) ReadUv();
        }));
    }

    void Try(Action action)
    {
        try { action(); }
        catch (Exception error) { Failure = Failure ?? error.Message; }
    }
}
