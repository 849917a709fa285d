using System;
using System.Collections.Generic;
using System.Linq;

namespace Facefolds
{
    /// <summary>x, y, width, height in pixels of a picture, y down from its upper edge.</summary>
    public struct Rect4
    {
        public double X, Y, Width, Height;

        public static Rect4 From(double[] v) { return new Rect4 { X = v[0], Y = v[1], Width = v[2], Height = v[3] }; }
    }

    public sealed class Layer
    {
        public string Mesh; // the file, and which bytes of it
        public int Offset, Bytes;
        public Rect4 Rect; // within the colours' part
        public double[] Window; // u0, u1, v0, v1
    }

    public sealed class Video
    {
        public string File, Codec, Container;
    }

    /// <summary>What a glossy surface adds to the colours, by the direction.</summary>
    public sealed class Reflection
    {
        public string File;
        public int Width, Height;
        public double[] Window;
        public Rect4 Environment, Gloss, Offset, Normals;
        public double EnvironmentScale, GlossScale, OffsetScale;
    }

    public sealed class Level
    {
        public string Name;
        public List<Layer> Layers; // outermost first
        public int Width, Height, Frames;
        public double Fps;
        public Rect4 Colour, Alpha;
        public List<Video> Videos;
        public Reflection Reflection; // null: none
    }

    /// <summary>Where the head stands in a frame: of the meshes' own points to the world, in the asset's axes.</summary>
    public struct Pose
    {
        public double[] Quaternion; // w, x, y, z
        public double[] Translation;
    }

    /// <summary>manifest.json. Keys that are not known are passed over; what is needed and wrong is a FormatException
    /// in words for people.</summary>
    public sealed class Manifest
    {
        public const int Known = 4;
        public string Subject;
        public int Version;
        public List<Level> Levels; // coarsest first
        public List<Pose> Track = new List<Pose>(); // empty: the head stands still, or TrackFile has not been read
        public string TrackFile; // null: none

        public static Manifest Parse(string text)
        {
            var fields = new Fields(Json.Parse(text), "");
            if (!fields.Has("format") || fields.Text("format") != "facefolds")
                throw new FormatException("this is no manifest of facefolds");
            int version = fields.Whole("version");
            int needed = fields.Has("minVersion") ? fields.Whole("minVersion") : version; // whose readers show it right
            if (version < Known || needed > Known)
                throw new FormatException("format " + version + " cannot be read: this player reads " + Known
                    + (needed > Known ? "; update the package" : "; make the asset again"));
            if (fields.Has("extensionsRequired"))
                throw new FormatException("the asset needs extensions that this player does not know; update the package");
            var result = new Manifest
            {
                Subject = fields.Has("subject") ? fields.Text("subject") : "",
                Version = version,
                Levels = fields.Objects("levels").Select(OfLevel).ToList(),
                TrackFile = fields.Has("track_file") ? PlainName(fields.Object("track_file").Text("file")) : null,
            };
            if (result.Levels.Count == 0) throw new FormatException("levels is empty");
            return result;
        }

        /// <summary>Takes the poses from the bytes of TrackFile: for each frame 7 little-endian numbers of 4 bytes.</summary>
        public void ReadTrack(byte[] bytes)
        {
            int frames = Levels.Last().Frames;
            if (bytes.Length != 28 * frames)
                throw new FormatException(TrackFile + " has " + bytes.Length + " bytes for " + frames + " frames");
            if (!BitConverter.IsLittleEndian)
                for (int i = 0; i < bytes.Length; i += 4) Array.Reverse(bytes, i, 4);
            var numbers = new float[7 * frames];
            Buffer.BlockCopy(bytes, 0, numbers, 0, bytes.Length);
            Track = Enumerable.Range(0, frames).Select(k => new Pose
            {
                Quaternion = Enumerable.Range(7 * k, 4).Select(i => (double)numbers[i]).ToArray(),
                Translation = Enumerable.Range(7 * k + 4, 3).Select(i => (double)numbers[i]).ToArray(),
            }).ToList();
        }

        /// <summary>The level of that name; the full one, which is the last, for an empty name.</summary>
        public Level LevelOf(string name)
        {
            if (string.IsNullOrEmpty(name)) return Levels.Last();
            Level found = Levels.FirstOrDefault(level => level.Name == name);
            if (found == null)
                throw new FormatException("there is no level " + name + ", but " + string.Join(", ", Levels.Select(l => l.Name).ToArray()));
            return found;
        }

        static Level OfLevel(Fields fields)
        {
            Fields texture = fields.Object("texture");
            var level = new Level
            {
                Name = fields.Text("name"),
                Layers = fields.Objects("layers").Select(OfLayer).ToList(),
                Width = texture.Whole("width"),
                Height = texture.Whole("height"),
                Frames = texture.Whole("frames"),
                Fps = Ratio(texture.Numbers("frame_rate", 2)),
                Colour = Rect4.From(texture.Numbers("colour_rect", 4)),
                Alpha = Rect4.From(texture.Numbers("alpha_rect", 4)),
                Videos = texture.Has("videos") ? texture.Objects("videos").Select(OfVideo).ToList() : new List<Video>(),
                Reflection = fields.Has("reflection") ? OfReflection(fields.Object("reflection")) : null,
            };
            if (level.Layers.Count == 0) throw new FormatException("level " + level.Name + " has no layers");
            if (level.Frames < 1 || level.Fps <= 0) throw new FormatException("level " + level.Name + " has no frames");
            return level;
        }

        static double Ratio(double[] rate) { return rate[1] > 0 ? rate[0] / rate[1] : 0; }

        static Layer OfLayer(Fields fields)
        {
            return new Layer
            {
                Mesh = PlainName(fields.Text("mesh")),
                Offset = fields.Whole("offset"),
                Bytes = fields.Whole("bytes"),
                Rect = Rect4.From(fields.Numbers("texture_rect", 4)),
                Window = fields.Numbers("uv_window", 4),
            };
        }

        static Video OfVideo(Fields fields)
        {
            return new Video
            {
                File = PlainName(fields.Text("file")),
                Codec = fields.Text("codec"),
                Container = fields.Has("container") ? fields.Text("container") : "",
            };
        }

        static Reflection OfReflection(Fields fields)
        {
            return new Reflection
            {
                File = PlainName(fields.Text("file")),
                Width = fields.Whole("width"),
                Height = fields.Whole("height"),
                Window = fields.Numbers("uv_window", 4),
                Environment = Rect4.From(fields.Numbers("environment_rect", 4)),
                Gloss = Rect4.From(fields.Numbers("gloss_rect", 4)),
                Offset = Rect4.From(fields.Numbers("offset_rect", 4)),
                Normals = Rect4.From(fields.Numbers("normals_rect", 4)),
                EnvironmentScale = fields.Number("environment_scale"),
                GlossScale = fields.Number("gloss_scale"),
                OffsetScale = fields.Number("offset_scale"),
            };
        }

        /// <summary>Files lie in the asset's folder itself: a name that leads elsewhere is refused.</summary>
        static string PlainName(string name)
        {
            if (name == "" || name.StartsWith(".") || name.IndexOfAny(new[] { '/', '\\', ':', '?', '#', '%' }) >= 0)
                throw new FormatException("\"" + name + "\" is no plain file name");
            return name;
        }
    }
}
