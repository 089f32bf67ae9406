using System;
using System.IO;
using System.Runtime.InteropServices;
using Athcodec;

static class Vectors
{
    [DllImport("ath_player")] static extern uint ath_crc32c(uint crc, float[] floats, UIntPtr size);
    [DllImport("ath_player", EntryPoint = "ath_crc32c")] static extern uint ath_crc32c_of(uint crc, uint[] words, UIntPtr size);
    static string Sum(float[] floats) { return ath_crc32c(0, floats, (UIntPtr)(4 * floats.Length)).ToString("x8"); }
    static string Sum(uint[] words) { return ath_crc32c_of(0, words, (UIntPtr)(4 * words.Length)).ToString("x8"); }

    static void Print(Func<string> text)
    {
        try { Console.WriteLine(text()); }
        catch (AthException error) { Console.WriteLine((int)error.Result); }
    }

    static void Play(AthPlayer player)
    {
        var info = player.Info;
        var lines = player.Lines();
        float[] xyz = new float[3 * info.VertexCount], normals = new float[xyz.Length];
        player.SetBudget(AthPlayer.Exact);
        Console.WriteLine("{0} {1} {2} {3}", player.Triangles.Length / 3, Sum(player.Triangles), lines.Length / 2, Sum(lines));
        for (int clip = 0; clip < info.ClipCount && clip < 2; clip++)
            for (int level = 0; level < info.LevelCount; level++)
                for (int step = 0; step < 3; step++)
                    Print(() =>
                    {
                        int shown = player.Positions(clip, step * 0.37 * player.Clips[clip].Duration, AthWrap.Loop, level, xyz);
                        player.Normals(xyz, normals);
                        return shown + " " + Sum(xyz) + " " + Sum(normals);
                    });
        Print(() =>
        {
            player.BlendedPositions(new[] {
                new AthShare { Clip = 0, Level = 0, Wrap = AthWrap.Loop, Seconds = 0.1, Weight = 0.75 },
                new AthShare { Clip = info.ClipCount - 1, Level = -1, Wrap = AthWrap.Clamp, Seconds = 0.2, Weight = 0.25 } }, xyz);
            return Sum(xyz);
        });
        var fade = new AthFade();
        fade.To(0, 0);
        fade.To(info.LevelCount - 1, 0.4);
        Print(() => { player.FadedPositions(0, 0.1, AthWrap.Loop, ref fade, xyz); return Sum(xyz); });
    }

    static int Main(string[] files)
    {
        for (int i = 0; i < files.Length; i++)
        {
            var bytes = File.ReadAllBytes(files[i]);
            AthPlayer player = null;
            Console.Write("{0} ", i + 1);
            Print(() => { player = new AthPlayer(bytes, bytes.Length); return "0"; });
            if (player != null) using (player) Play(player);
        }
        return 0;
    }
}
