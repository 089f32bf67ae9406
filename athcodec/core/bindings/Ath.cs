// Plays .ath files, the motion of plants with levels of detail, from C#: AthPlayer over the C library ath_player, which
// `cmake -DATH_BUILD_PLAYER=ON` builds from athcodec/core. One file to copy, for Mono and for what has netstandard 2.1.
//
//     using (var player = new AthPlayer(bytes, bytes.Length))
//     {
//         var xyz = new float[3 * player.Info.VertexCount];
//         player.Positions(0, seconds, AthWrap.Loop, player.LevelFor(distance, fov, height), xyz);   // for each picture
//         player.Ahead();
//     }
//
// What each call does: ath_player.h and ath.h. Positions are in scene units and in the source's order, x, y, z of one vertex
// after the other; times are in seconds. Calls for each picture write to the caller's arrays and allocate nothing. Use a
// player from one thread at a time. An AthException says what is wrong with a file; arrays that are too short are refused.
using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;
using System.Text;

namespace Athcodec
{
    /// <summary>Results of the C library that a caller asks about; FORMAT.md, "Errors", has those below 64.</summary>
    public enum AthResult { Ok = 0, BadChecksum = 5, BadChunk = 9, More = 64, Held = 65, Missing = 66, NotPrepared = 67, NoMemory = 68, BadArgument = 69 }

    /// <summary>How a clip goes on after its last frame.</summary>
    public enum AthWrap { Clamp = 0, Loop = 1, PingPong = 2, AsMarked = 3 }

    /// <summary>A summary of the errors of all vertices in all frames: the largest, the 99th percentile, the root mean square.</summary>
    public enum AthMeasure { Largest = 0, P99 = 1, Rms = 2 }

    /// <summary>What the elements of an array are.</summary>
    public enum AthKind { Booleans = 0, Unsigned = 1, Integers = 2, Floats = 3, Texts = 4 }

    /// <summary>Unpacks one zstd frame into so many bytes. Any zstd library will do, such as the package ZstdSharp.Port.</summary>
    public delegate byte[] AthUnpack(byte[] packed, int bytes);

    /// <summary>Why a file is refused or damaged, or what is missing of it.</summary>
    public sealed class AthException : Exception
    {
        /// <summary>The result of the call.</summary>
        public AthResult Result { get; }

        internal AthException(int result, string message) : base(message) { Result = (AthResult)result; }
    }

    /// <summary>What a file holds: ath_info.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct AthInfo
    {
        public ulong FileLength, PreludeLength;
        public double MaxError, OriginX, OriginY, OriginZ;
        public int VertexCount, PlaceCount, BranchCount, FrameCount, SegmentCount, ClipCount, LevelCount, FullLevelCount,
            LayerCount, DepthLevels, NodeCount, ChunkCount, IsFloat64, RestIsFloat64, RestIsHost;
        public uint HostChecksum0, HostChecksum1;
        public int IsPredicted;
    }

    /// <summary>A clip: frames and segments are numbered over the whole file. Duration: seconds from its first frame to its last.</summary>
    public sealed class AthClip
    {
        public string Name { get; internal set; }
        public double Duration { get; internal set; }
        public int FirstFrame { get; internal set; }
        public int FrameCount { get; internal set; }
        public int FirstSegment { get; internal set; }
        public int SegmentCount { get; internal set; }
        public bool IsLoop { get; internal set; }
        /// <summary>The last of its segments.</summary>
        public int LastSegment { get { return FirstSegment + SegmentCount - 1; } }
    }

    /// <summary>Bytes of a file: ath_range.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct AthRange
    {
        public ulong Offset, Size;
    }

    /// <summary>One clip of a blend, at a time and level, with a weight: ath_player_share.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct AthShare
    {
        public int Clip, Level;
        public AthWrap Wrap;
        public double Seconds, Weight;
    }

    /// <summary>The wind of a clip; the heading is in degrees. A strength that is not finite: none. ath_wind.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct AthWind
    {
        public double Strength, Heading;
    }

    /// <summary>Goes from level to level over a moment, without a jump: ath_fade. It begins as `new AthFade()`.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct AthFade
    {
        int count, level0, level1, level2, level3;
        double weight0, weight1, weight2, weight3, passed0, passed1, passed2, passed3;

        /// <summary>Once for each picture: goes to a level that is prepared, as AthPlayer.Show returns it. share: the time since
        /// the last call over that of a fade, such as seconds / 0.2.</summary>
        public void To(int level, double share) { Native.ath_fade_to(ref this, level, share); }

        /// <summary>The number of levels that are shown; 1: nothing fades.</summary>
        public int Count { get { return count; } }
    }

    /// <summary>A named array of the source, such as "uv", its elements in row-major order.</summary>
    public sealed class AthArray
    {
        public AthKind Kind { get; internal set; }
        public int ItemBytes { get; internal set; }
        public int[] Shape { get; internal set; }
        /// <summary>All elements, little-endian.</summary>
        public byte[] Bytes { get; internal set; }

        /// <summary>Returns the elements, if they are floats of 4 bytes; null: they are something else.</summary>
        public float[] Floats()
        {
            if (Kind != AthKind.Floats || ItemBytes != 4) return null;
            var floats = new float[Bytes.Length / 4];
            Buffer.BlockCopy(Bytes, 0, floats, 0, Bytes.Length);
            return floats;
        }
    }

    /// <summary>Plays one file.</summary>
    public sealed class AthPlayer : IDisposable
    {
        /// <summary>The work of a call by default, about 2 ms; and Exact: a call waits for the level that it asks for.</summary>
        public const int DefaultBudget = 150000, Exact = int.MaxValue;

        readonly PlayerHandle player = new PlayerHandle();
        readonly FileHandle file;
        readonly AthInfo info;
        uint[] triangles;

        /// <summary>Returns how many bytes of the front of a file the constructor needs; 0: these `count` bytes suffice. Come back
        /// with so many; more may be needed then.</summary>
        public static long Needed(byte[] bytes, int count)
        {
            Room(bytes, count, "bytes");
            Native.Fault fault;
            UIntPtr front, memory;
            int result = Native.ath_front(bytes, Size(count), IntPtr.Zero, out front, out memory, out fault);
            if (result == (int)AthResult.Missing) return (long)front.ToUInt64();
            Check(result, ref fault);
            return 0;
        }

        /// <summary>Opens a file, of whose front `count` bytes are there, and copies them. hostMesh: the rest pose of a file that
        /// has none, 3 numbers a vertex. cacheBytes: memory of prepared segments beyond those shown; 0: 64 MiB.</summary>
        public AthPlayer(byte[] bytes, int count, float[] hostMesh = null, long cacheBytes = 0)
        {
            Room(bytes, count, "bytes");
            var mesh = hostMesh == null ? default(GCHandle) : GCHandle.Alloc(hostMesh, GCHandleType.Pinned);
            try
            {
                var options = new Native.Options { CacheBytes = Size(cacheBytes), HostStride = Size(12) };
                if (hostMesh != null) options.HostMesh = mesh.AddrOfPinnedObject();
                if (hostMesh != null) options.HostVertexCount = hostMesh.Length / 3;
                Native.Fault fault;
                IntPtr opened;
                int result = Native.ath_player_open(out opened, player.Copy(bytes, count), Size(count), ref options, out fault);
                player.Set(opened);
                Check(result, ref fault);
                file = new FileHandle(player);
            }
            catch
            {
                player.Dispose();
                throw;
            }
            finally
            {
                if (mesh.IsAllocated) mesh.Free();
            }
            Native.ath_get_info(file, out info);
            Clips = new AthClip[info.ClipCount];
            IntPtr clips = Native.ath_clips(file);
            for (int i = 0; i < Clips.Length; i++)
            {
                int size = Marshal.SizeOf(typeof(Native.Clip));
                var clip = (Native.Clip)Marshal.PtrToStructure(new IntPtr(clips.ToInt64() + (long)i * size), typeof(Native.Clip));
                Clips[i] = new AthClip
                {
                    Name = Text(clip.Name), Duration = clip.Duration, FirstFrame = clip.FirstFrame, FrameCount = clip.FrameCount,
                    FirstSegment = clip.FirstSegment, SegmentCount = clip.SegmentCount, IsLoop = clip.Loop != 0
                };
            }
        }

        public void Dispose()
        {
            file.Dispose();
            player.Dispose();
        }

        public AthInfo Info { get { return info; } }
        public AthClip[] Clips { get; }

        /// <summary>Whether the last positions are a frame without its blend, since the other frame is not prepared.</summary>
        public bool IsHeld { get; private set; }

        // ---- bytes ----

        /// <summary>Hands over a range of the file, and copies it: chunks that lie wholly inside can be used from now on.</summary>
        public void Feed(byte[] bytes, int count, long offset)
        {
            Room(bytes, count, "bytes");
            Native.ath_player_feed(player, player.Copy(bytes, count), (ulong)offset, Size(count));
        }

        /// <summary>Writes the ranges that segments need for a level and that have not been fed; with `all` those that have been,
        /// too. Returns their number, which may be larger than the array.</summary>
        public int Ranges(int level, int firstSegment, int lastSegment, AthRange[] ranges, bool all = false)
        {
            Segments(firstSegment, lastSegment);
            return Native.ath_ranges(file, Level(level), firstSegment, lastSegment, all ? 1 : 0, ranges, ranges.Length);
        }

        /// <summary>Writes the ranges of the arrays that have not been fed, which no level needs. Returns their number.</summary>
        public int ArrayRanges(AthRange[] ranges) { return Native.ath_array_ranges(file, ranges, ranges.Length); }

        // ---- levels ----

        /// <summary>Returns the coarsest level whose error is at most `pixels`, seen from `distance` (scene units) under a vertical
        /// field of view of `fov` (radians) on a screen of `height` pixels. It judges the segments of one clip.</summary>
        public int LevelFor(double distance, double fov, double height, double pixels = 1, int clip = 0, AthMeasure measure = AthMeasure.P99)
        {
            return Native.ath_level_for(file, Clips[clip].FirstSegment, Clips[clip].LastSegment, (int)measure, distance, fov, height, pixels);
        }

        /// <summary>Returns the error of a level in a clip, scene units.</summary>
        public double LevelError(int level, int clip = 0, AthMeasure measure = AthMeasure.P99)
        {
            return Native.ath_level_error(file, Level(level), Clips[clip].FirstSegment, Clips[clip].LastSegment, (int)measure);
        }

        /// <summary>Returns the name of a level for people, such as "layer 2 of 3".</summary>
        public string LevelName(int level)
        {
            var text = new byte[Native.LevelNameBytes];
            return Encoding.UTF8.GetString(text, 0, (int)Native.ath_level_name(file, Level(level), text, Size(text.Length)));
        }

        /// <summary>Returns the deepest level that a segment can be shown at with what has been fed; -1: none.</summary>
        public int ReadyLevel(int segment)
        {
            Segments(segment, segment);
            return Native.ath_ready_level(file, segment);
        }

        // ---- playing ----

        /// <summary>Sets what each call that shows something may spend: DefaultBudget at first.</summary>
        public void SetBudget(int vertexFrames) { Native.ath_player_set_budget(player, vertexFrames); }

        /// <summary>Prepares a clip at a time, at a level (-1: the deepest) or the best that is prepared. Returns the level.</summary>
        public int Show(int clip, double seconds, AthWrap wrap, int level)
        {
            Native.Moment moment;
            Check(Native.ath_player_show(player, clip, seconds, (int)wrap, level, out moment));
            return moment.Level;
        }

        /// <summary>Does the same and writes the positions of all vertices. Returns the level that they have.</summary>
        public int Positions(int clip, double seconds, AthWrap wrap, int level, float[] xyz)
        {
            Native.Moment moment;
            Vertices(xyz, 3, "xyz");
            Check(Native.ath_player_show(player, clip, seconds, (int)wrap, level, out moment));
            CheckHeld(Native.ath_positions(file, ref moment.Segments, moment.SegmentCount, moment.Frame, Native.SourceOrder, xyz, Size(12)));
            return moment.Level;
        }

        /// <summary>Writes the positions of all levels of a fade, blended.</summary>
        public void FadedPositions(int clip, double seconds, AthWrap wrap, ref AthFade fade, float[] xyz)
        {
            Vertices(xyz, 3, "xyz");
            CheckHeld(Native.ath_player_faded_positions(player, clip, seconds, (int)wrap, ref fade, Native.SourceOrder, xyz, Size(12)));
        }

        /// <summary>Writes the positions of several clips, blended by weights.</summary>
        public void BlendedPositions(AthShare[] shares, float[] xyz)
        {
            Vertices(xyz, 3, "xyz");
            CheckHeld(Native.ath_player_blended_positions(player, shares, shares.Length, Native.SourceOrder, xyz, Size(12)));
        }

        /// <summary>Writes the positions of the clips that fit a wind, blended. winds: one for each clip.</summary>
        public void WindPositions(AthWind[] winds, double strength, double heading, double seconds, AthWrap wrap, int level, float[] xyz)
        {
            Vertices(xyz, 3, "xyz");
            if (winds.Length < info.ClipCount) throw new ArgumentException("winds: got " + winds.Length + ", expected one for each of " + info.ClipCount + " clips");
            CheckHeld(Native.ath_player_wind_positions(player, winds, strength, heading, seconds, (int)wrap, level, Native.SourceOrder, xyz, Size(12)));
        }

        /// <summary>Prepares what comes next, for a budget. Returns whether something is left to do.</summary>
        public bool Ahead(int vertexFrames = DefaultBudget)
        {
            int result = Native.ath_player_ahead(player, vertexFrames);
            if (result != (int)AthResult.More) Check(result);
            return result == (int)AthResult.More;
        }

        // ---- surfaces ----

        /// <summary>The triangles of the faces, three vertices each; empty: the file has no faces.</summary>
        public uint[] Triangles { get { return triangles ?? (triangles = Primitives(3, Native.ath_player_triangles)); } }

        /// <summary>Returns the edges, two vertices each: those of the source, or else those along its stems.</summary>
        public uint[] Lines() { return Primitives(2, Native.ath_player_lines); }

        /// <summary>Writes the normals of vertices at these positions, 3 numbers each; zeros for vertices without triangles.</summary>
        public void Normals(float[] xyz, float[] normals)
        {
            Vertices(xyz, 3, "xyz");
            Vertices(normals, 3, "normals");
            Native.ath_player_normals(Triangles, Size(Triangles.Length / 3), xyz, Size(12), info.VertexCount, normals);
        }

        /// <summary>Writes the box of these positions, for culling: least x, y, z, then largest x, y, z.</summary>
        public void Bounds(float[] xyz, float[] box)
        {
            Vertices(xyz, 3, "xyz");
            if (box.Length != 6) throw new ArgumentException("box: got " + box.Length + " numbers, expected 6");
            Native.ath_player_bounds(xyz, Size(12), info.VertexCount, box);
        }

        /// <summary>Writes the tangents as glTF has them, 4 numbers each. uv: 2 numbers a vertex.</summary>
        public void Tangents(float[] xyz, float[] uv, float[] normals, float[] tangents)
        {
            Vertices(xyz, 3, "xyz");
            Vertices(uv, 2, "uv");
            Vertices(normals, 3, "normals");
            Vertices(tangents, 4, "tangents");
            Native.ath_player_tangents(Triangles, Size(Triangles.Length / 3), xyz, Size(12), uv, Size(8), normals, info.VertexCount, tangents);
        }

        // ---- arrays and metadata ----

        /// <summary>Returns a named array of the source; null: no array that has been fed has the name.</summary>
        public AthArray Array(string name, AthUnpack unpack)
        {
            Native.Fault fault;
            Native.Array head;
            int chunk = Native.ath_array_named(file, Encoding.UTF8.GetBytes(name + "\0"));
            if (chunk < 0) return null;
            Check(Native.ath_array_of(file, chunk, out head, out fault), ref fault);
            byte[] unpacked = Unpacked(head.Packed, head.PackedBytes, head.Bytes, unpack), elements = new byte[unpacked.Length];
            if (elements.Length > 0) Native.ath_array_elements(ref head, unpacked, elements);
            var shape = new int[head.DimensionCount];
            for (int i = 0; i < shape.Length; i++) shape[i] = (int)head.Shape[i];
            return new AthArray { Kind = (AthKind)head.Kind, ItemBytes = (int)head.ItemBytes, Shape = shape, Bytes = elements };
        }

        /// <summary>Returns the metadata of the source, a JSON object such as {"unit": "m", "up_axis": "y"}.</summary>
        public string Metadata(AthUnpack unpack)
        {
            Native.Fault fault;
            Native.Metadata text;
            Check(Native.ath_metadata_of(file, out text, out fault), ref fault);
            if (text.Stored == IntPtr.Zero) return "{}";
            if (text.IsPacked != 0) return Encoding.UTF8.GetString(Unpacked(text.Stored, text.StoredBytes, text.Bytes, unpack));
            return Encoding.UTF8.GetString(Copied(text.Stored, text.StoredBytes));
        }

        // ---- arguments and results ----

        static UIntPtr Size(long size) { return new UIntPtr((ulong)size); }

        static void Room(byte[] array, int count, string name)
        {
            if (count < 0 || count > array.Length) throw new ArgumentException(name + ": got " + array.Length + ", expected at least " + count);
        }

        void Vertices(float[] array, int columns, string name)
        {
            long size = (long)columns * info.VertexCount;
            if (array.Length < size) throw new ArgumentException(name + ": got " + array.Length + " numbers, expected " + size);
        }

        int Level(int level)
        {
            if (level >= 0 && level < info.LevelCount) return level;
            throw new ArgumentOutOfRangeException("level", "got " + level + ", expected 0 to " + (info.LevelCount - 1));
        }

        void Segments(int first, int last)
        {
            if (first >= 0 && first <= last && last < info.SegmentCount) return;
            throw new ArgumentOutOfRangeException("segments", "got " + first + " to " + last + ", expected some of " + info.SegmentCount);
        }

        delegate int Filling(PlayerHandle player, int order, uint[] primitives, out UIntPtr count);

        uint[] Primitives(int corners, Filling fill)
        {
            UIntPtr count;
            int result = fill(player, Native.SourceOrder, null, out count);
            if (result == (int)AthResult.BadArgument) return new uint[0];
            Check(result);
            var primitives = new uint[checked((long)count.ToUInt64() * corners)];
            if (primitives.Length > 0) Check(fill(player, Native.SourceOrder, primitives, out count));
            return primitives;
        }

        static byte[] Copied(IntPtr from, ulong size)
        {
            var bytes = new byte[checked((int)size)];
            if (bytes.Length > 0) Marshal.Copy(from, bytes, 0, bytes.Length);
            return bytes;
        }

        static byte[] Unpacked(IntPtr packed, ulong packedBytes, ulong bytes, AthUnpack unpack)
        {
            byte[] content = bytes > 0 ? unpack(Copied(packed, packedBytes), checked((int)bytes)) : new byte[0];
            if (content != null && (ulong)content.Length == bytes) return content;
            throw new AthException((int)AthResult.BadChunk, "a zstd frame is damaged: expected " + bytes + " bytes in it");
        }

        static string Text(IntPtr utf8)
        {
            int length = 0;
            while (Marshal.ReadByte(utf8, length) != 0) length++;
            return Encoding.UTF8.GetString(Copied(utf8, (ulong)length));
        }

        void CheckHeld(int result)
        {
            IsHeld = result == (int)AthResult.Held;
            if (!IsHeld) Check(result);
        }

        void Check(int result)
        {
            if (result == (int)AthResult.Ok) return;
            var fault = (Native.Fault)Marshal.PtrToStructure(Native.ath_player_fault(player), typeof(Native.Fault));
            Check(result, ref fault);
        }

        static void Check(int result, ref Native.Fault fault)
        {
            if (result == (int)AthResult.Ok) return;
            string name = Text(Native.ath_result_name(result));
            if (fault.Code != result) throw new AthException(result, name);
            var text = new byte[Native.FaultTextBytes];
            int length = (int)Native.ath_fault_text(ref fault, text, Size(text.Length));
            throw new AthException(result, name + ": " + Encoding.UTF8.GetString(text, 0, length));
        }
    }

    // A player and the bytes that it reads.
    sealed class PlayerHandle : SafeHandle
    {
        readonly List<IntPtr> blocks = new List<IntPtr>();

        internal PlayerHandle() : base(IntPtr.Zero, true) { }

        public override bool IsInvalid { get { return false; } }

        internal void Set(IntPtr player) { SetHandle(player); }

        internal IntPtr Copy(byte[] bytes, int count)
        {
            IntPtr block = Marshal.AllocHGlobal(Math.Max(count, 1));
            blocks.Add(block);
            Marshal.Copy(bytes, 0, block, count);
            return block;
        }

        protected override bool ReleaseHandle()
        {
            Native.ath_player_close(handle);
            foreach (IntPtr block in blocks) Marshal.FreeHGlobal(block);
            return true;
        }
    }

    // The file of a player, which stays open as long as this.
    sealed class FileHandle : SafeHandle
    {
        readonly PlayerHandle player;

        internal FileHandle(PlayerHandle player) : base(IntPtr.Zero, true)
        {
            bool isHeld = false;
            player.DangerousAddRef(ref isHeld);
            this.player = player;
            SetHandle(Native.ath_player_file(player));
        }

        public override bool IsInvalid { get { return false; } }

        protected override bool ReleaseHandle()
        {
            player.DangerousRelease();
            return true;
        }
    }

    // The C functions and structs, under the names of the headers.
    static class Native
    {
        const string Library = "ath_player";
        internal const int SourceOrder = 1, FaultTextBytes = 256, LevelNameBytes = 32;

        [StructLayout(LayoutKind.Sequential)]
        internal struct Fault
        {
            internal int Code, Field, Chunk;
            internal ushort Kind;
            internal byte Level, Reserved;
            internal uint Segment;
            internal ulong Offset;
            internal double Found, Least, Most;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct Options
        {
            internal IntPtr Allocate, Release, Context;
            internal UIntPtr CacheBytes;
            internal IntPtr Limits, HostMesh;
            internal UIntPtr HostStride;
            internal int HostVertexCount, InSlices;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct Clip
        {
            internal IntPtr Name;
            internal double Duration;
            internal int FirstFrame, FrameCount, FirstSegment, SegmentCount, Loop, Periodic;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct SegmentPair
        {
            internal IntPtr First, Second;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct Moment
        {
            internal double Frame;
            internal int Level, SegmentCount;
            internal SegmentPair Segments;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct Array
        {
            internal IntPtr Name, Packed;
            internal ulong PackedBytes, Bytes;
            internal uint NameBytes, Kind, ItemBytes, DimensionCount;
            [MarshalAs(UnmanagedType.ByValArray, SizeConst = 32)]
            internal uint[] Shape;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct Metadata
        {
            internal IntPtr Stored;
            internal ulong StoredBytes, Bytes;
            internal int IsPacked;
        }

        [DllImport(Library)] internal static extern int ath_front(byte[] bytes, UIntPtr available, IntPtr limits, out UIntPtr front_bytes, out UIntPtr memory_bytes, out Fault fault);
        [DllImport(Library)] internal static extern IntPtr ath_result_name(int result);
        [DllImport(Library)] internal static extern UIntPtr ath_fault_text(ref Fault fault, byte[] text, UIntPtr capacity);
        [DllImport(Library)] internal static extern void ath_get_info(FileHandle file, out AthInfo info);
        [DllImport(Library)] internal static extern IntPtr ath_clips(FileHandle file);
        [DllImport(Library)] internal static extern int ath_ranges(FileHandle file, int level, int first_segment, int last_segment, int all, [Out] AthRange[] ranges, int capacity);
        [DllImport(Library)] internal static extern int ath_array_ranges(FileHandle file, [Out] AthRange[] ranges, int capacity);
        [DllImport(Library)] internal static extern int ath_array_named(FileHandle file, byte[] name);
        [DllImport(Library)] internal static extern int ath_array_of(FileHandle file, int chunk, out Array array, out Fault fault);
        [DllImport(Library)] internal static extern void ath_array_elements(ref Array array, byte[] unpacked, [Out] byte[] elements);
        [DllImport(Library)] internal static extern int ath_metadata_of(FileHandle file, out Metadata metadata, out Fault fault);
        [DllImport(Library)] internal static extern int ath_ready_level(FileHandle file, int segment);
        [DllImport(Library)] internal static extern int ath_level_for(FileHandle file, int first_segment, int last_segment, int measure, double distance, double fov, double height, double pixels);
        [DllImport(Library)] internal static extern double ath_level_error(FileHandle file, int level, int first_segment, int last_segment, int measure);
        [DllImport(Library)] internal static extern UIntPtr ath_level_name(FileHandle file, int level, [Out] byte[] text, UIntPtr capacity);
        [DllImport(Library)] internal static extern int ath_positions(FileHandle file, ref SegmentPair segments, int segment_count, double frame, int order, [Out] float[] xyz, UIntPtr stride);
        [DllImport(Library)] internal static extern void ath_fade_to(ref AthFade fade, int level, double share);
        [DllImport(Library)] internal static extern int ath_player_open(out IntPtr player, IntPtr bytes, UIntPtr size, ref Options options, out Fault fault);
        [DllImport(Library)] internal static extern void ath_player_close(IntPtr player);
        [DllImport(Library)] internal static extern void ath_player_feed(PlayerHandle player, IntPtr bytes, ulong offset, UIntPtr size);
        [DllImport(Library)] internal static extern IntPtr ath_player_file(PlayerHandle player);
        [DllImport(Library)] internal static extern IntPtr ath_player_fault(PlayerHandle player);
        [DllImport(Library)] internal static extern void ath_player_set_budget(PlayerHandle player, int vertex_frames);
        [DllImport(Library)] internal static extern int ath_player_show(PlayerHandle player, int clip, double seconds, int wrap, int level, out Moment moment);
        [DllImport(Library)] internal static extern int ath_player_faded_positions(PlayerHandle player, int clip, double seconds, int wrap, ref AthFade fade, int order, [Out] float[] xyz, UIntPtr stride);
        [DllImport(Library)] internal static extern int ath_player_blended_positions(PlayerHandle player, AthShare[] shares, int share_count, int order, [Out] float[] xyz, UIntPtr stride);
        [DllImport(Library)] internal static extern int ath_player_wind_positions(PlayerHandle player, AthWind[] winds, double strength, double heading, double seconds, int wrap, int level, int order, [Out] float[] xyz, UIntPtr stride);
        [DllImport(Library)] internal static extern int ath_player_ahead(PlayerHandle player, int vertex_frames);
        [DllImport(Library)] internal static extern int ath_player_triangles(PlayerHandle player, int order, [Out] uint[] triangles, out UIntPtr count);
        [DllImport(Library)] internal static extern int ath_player_lines(PlayerHandle player, int order, [Out] uint[] lines, out UIntPtr count);
        [DllImport(Library)] internal static extern void ath_player_normals(uint[] triangles, UIntPtr count, float[] xyz, UIntPtr stride, int vertex_count, [Out] float[] normals);
        [DllImport(Library)] internal static extern void ath_player_bounds(float[] xyz, UIntPtr stride, int vertex_count, [Out] float[] box);
        [DllImport(Library)] internal static extern void ath_player_tangents(uint[] triangles, UIntPtr count, float[] xyz, UIntPtr stride, float[] uv, UIntPtr uv_stride, float[] normals, int vertex_count, [Out] float[] tangents);
    }
}
