// Plays an .ath file and prints where its plant is: PlayPlant FILE DISTANCE FRAMES. Its glue is what an engine's script has.
using System;
using System.Diagnostics;
using System.IO;
using System.Runtime.InteropServices;

static class PlayPlant
{
    [DllImport("zstd")] static extern UIntPtr ZSTD_decompress(byte[] to, UIntPtr capacity, byte[] from, UIntPtr size);

    static byte[] Unpack(byte[] packed, int bytes)
    {
        var unpacked = new byte[bytes];
        ulong size = ZSTD_decompress(unpacked, (UIntPtr)bytes, packed, (UIntPtr)packed.Length).ToUInt64();
        return size == (ulong)bytes ? unpacked : null;
    }

    static int Main(string[] words)
    {
        double distance = double.Parse(words[1], System.Globalization.CultureInfo.InvariantCulture);
        int frames = int.Parse(words[2]), level = -1;
        long fetched = 0;
        var watch = new Stopwatch();
        using (var file = File.OpenRead(words[0]))
        using (var plant = new Plant((offset, size, arrived) =>
        {
            file.Position = offset; // as a request for a range would
            var bytes = new byte[Math.Max(Math.Min(size, file.Length - offset), 0)];
            fetched += file.Read(bytes, 0, bytes.Length);
            arrived(bytes);
        }, Unpack))
        {
            for (int frame = 0; frame < frames && plant.Failure == null; frame++)
            {
                watch.Start();
                level = plant.Update(frame / 60.0, distance, 0.8, 1080);
                watch.Stop();
            }
            if (plant.Failure != null) Console.Error.WriteLine(plant.Failure);
            if (level < 0) return 1;
            Console.WriteLine("level {0} of {1}, {2} of {3} bytes, {4} triangles, {5} with texture coordinates, {6:F1} ms a frame",
                level, plant.Player.Info.LevelCount, fetched, plant.Player.Info.FileLength, plant.Triangles.Length / 3,
                plant.Uv != null ? "vertices" : "none", watch.Elapsed.TotalMilliseconds / frames);
        }
        return 0;
    }
}
