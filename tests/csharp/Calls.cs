using System;
using System.IO;
using System.Linq;
using System.Runtime.InteropServices;
using Athcodec;

static class Calls
{
    [DllImport("zstd")] static extern UIntPtr ZSTD_decompress(byte[] to, UIntPtr capacity, byte[] from, UIntPtr size);

    static byte[] Unpack(byte[] packed, int bytes)
    {
        var unpacked = new byte[bytes];
        return (int)ZSTD_decompress(unpacked, (UIntPtr)bytes, packed, (UIntPtr)packed.Length) == bytes ? unpacked : null;
    }

    static string Thrown(Action call)
    {
        try { call(); return "nothing"; }
        catch (Exception error) { return error.GetType().Name + " " + error.Message.Split('\n')[0]; }
    }

    static void Main(string[] words)
    {
        var bytes = File.ReadAllBytes(words[0]);
        foreach (int count in new[] { 0, 100 }) Console.WriteLine(AthPlayer.Needed(bytes, count) > count);
        Console.WriteLine(AthPlayer.Needed(bytes, bytes.Length));
        Console.WriteLine(Thrown(() => new AthPlayer(new byte[100], 100)));
        Console.WriteLine(Thrown(() => new AthPlayer(bytes, 120)));
        Console.WriteLine(Thrown(() => new AthPlayer(bytes, bytes.Length + 1)));
        var player = new AthPlayer(bytes, bytes.Length);
        var xyz = new float[3 * player.Info.VertexCount];
        var few = new float[xyz.Length - 1];
        Console.WriteLine(string.Join(", ", player.Clips.Select(clip => clip.Name + " " + clip.FrameCount)));
        Console.WriteLine(player.LevelName(player.Info.LevelCount - 1) + ", " + player.LevelError(0, 0, AthMeasure.Rms).ToString("R"));
        Console.WriteLine(player.Metadata(null));
        var tree = File.ReadAllBytes(words[1]);
        using (var other = new AthPlayer(tree, tree.Length))
        {
            AthArray uv = other.Array("uv", Unpack);
            Console.WriteLine("{0} x {1}, {2:R}, {3} other", uv.Shape[0], uv.Shape[1], uv.Floats().Sum(value => (double)value),
                other.Array("uvw", Unpack) == null ? "no" : "an");
            Console.WriteLine(Thrown(() => other.Array("uv", (packed, size) => new byte[size - 1])));
        }
        Action[] calls = {
            () => player.Positions(0, 0, AthWrap.Loop, 0, few), () => player.Positions(player.Clips.Length, 0, AthWrap.Loop, 0, xyz),
            () => player.Normals(few, xyz), () => player.Normals(xyz, few), () => player.LevelName(99), () => player.LevelError(-1),
            () => player.Ranges(0, 0, 99, new AthRange[1]), () => player.ReadyLevel(-1), () => player.LevelFor(1, 1, 1, 1, 9),
            () => player.Tangents(xyz, few, xyz, xyz), () => player.Bounds(xyz, few), () => player.WindPositions(new AthWind[0], 0, 0, 0, AthWrap.Loop, 0, xyz),
            () => player.BlendedPositions(new AthShare[0], xyz), () => player.Feed(bytes, bytes.Length + 1, 0) };
        foreach (var call in calls) Console.WriteLine(Thrown(call));
        player.Positions(0, 0, AthWrap.Loop, -1, xyz);
        var box = new float[6];
        player.Bounds(xyz, box);
        var corner = Enumerable.Range(0, 6).Select(k => xyz.Where((_, i) => i % 3 == k % 3)).Select((each, k) => k < 3 ? each.Min() : each.Max());
        Console.WriteLine(box.SequenceEqual(corner) ? "bounds hold" : "bounds do not hold");
        var fade = new AthFade();
        for (int round = 0; round < 2; round++) // all that is allocated once is allocated in the first
        {
            int before = GC.CollectionCount(0);
            for (int frame = 0; frame < 30000; frame++)
            {
                double seconds = frame / 60.0;
                int shown = player.Positions(0, seconds, AthWrap.Loop, player.LevelFor(1e-3, 0.8, 1080), xyz);
                player.Ahead();
                player.Normals(xyz, xyz);
                player.Bounds(xyz, box);
                fade.To(shown, 0.1);
                player.FadedPositions(0, seconds, AthWrap.Loop, ref fade, xyz);
            }
            if (round > 0) Console.WriteLine("{0} collections", GC.CollectionCount(0) - before);
        }
        player.Dispose();
        player.Dispose();
        Console.WriteLine(Thrown(() => player.Positions(0, 0, AthWrap.Loop, 0, xyz)));
        Console.WriteLine(Thrown(() => player.LevelFor(1, 1, 1)));
    }
}
