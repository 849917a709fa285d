// Runs the package's plain C# for tests/engines/test_unity.py.
//   read MANIFEST             what was read, a line each; or the error
//   poses MANIFEST FILE       those of the track's file, a line each; or the error
//   pose w x y z              the rotation as Unity's quaternion, and its rows
//   draw MANIFEST FOLDER      FOLDER/{picture,st,along[,maps]}.f32 -> FOLDER/drawn.f32; [room.f32]: rows of a rotation
using System;
using System.Globalization;
using System.IO;
using System.Linq;
using Facefolds;

static class Check
{
    static int Main(string[] words)
    {
        CultureInfo.DefaultThreadCurrentCulture = new CultureInfo("de-DE"); // a comma as decimal point must not matter
        System.Threading.Thread.CurrentThread.CurrentCulture = new CultureInfo("de-DE");
        try
        {
            if (words[0] == "read") Read(Manifest.Parse(File.ReadAllText(words[1])));
            if (words[0] == "poses") Poses(Manifest.Parse(File.ReadAllText(words[1])), File.ReadAllBytes(words[2]));
            if (words[0] == "pose") Turn(words.Skip(1).Select(word => double.Parse(word, CultureInfo.InvariantCulture)).ToArray());
            if (words[0] == "draw") Draw(Manifest.Parse(File.ReadAllText(words[1])).LevelOf(""), words[2]);
            return 0;
        }
        catch (FormatException error)
        {
            Console.WriteLine(error.Message);
            return 1;
        }
    }

    static string Said(params double[] values)
    {
        return string.Join(" ", values.Select(value => value.ToString("R", CultureInfo.InvariantCulture)).ToArray());
    }

    static void Read(Manifest manifest)
    {
        Console.WriteLine(manifest.Subject);
        foreach (Level level in manifest.Levels)
        {
            Console.WriteLine(level.Name + " " + Said(level.Width, level.Height, level.Frames, level.Fps, level.Layers.Count));
            foreach (Layer layer in level.Layers)
                Console.WriteLine(layer.Mesh + " " + Said(layer.Offset, layer.Bytes) + " " + Said(layer.Rect.X, layer.Rect.Y, layer.Rect.Width, layer.Rect.Height)
                    + " " + Said(Drawing.InPicture(layer.Rect, level.Alpha, level.Width, level.Height)));
        }
    }

    static void Poses(Manifest manifest, byte[] bytes)
    {
        manifest.ReadTrack(bytes);
        foreach (Pose pose in manifest.Track) Console.WriteLine(Said(pose.Quaternion) + " " + Said(pose.Translation));
    }

    static void Turn(double[] q)
    {
        Console.WriteLine(Said(Axes.RotationToUnity(q)));
        foreach (double[] row in Axes.Matrix(q)) Console.WriteLine(Said(row));
        for (int i = 0; i < 3; ++i) Console.WriteLine(Said(Axes.ToUnity(i == 0 ? 1 : 0, i == 1 ? 1 : 0, i == 2 ? 1 : 0)));
    }

    static float[] Floats(string path)
    {
        byte[] bytes = File.ReadAllBytes(path);
        var values = new float[bytes.Length / 4];
        Buffer.BlockCopy(bytes, 0, values, 0, bytes.Length);
        return values;
    }

    static void Draw(Level level, string folder)
    {
        float[] picture = Floats(folder + "/picture.f32"), st = Floats(folder + "/st.f32"), along = Floats(folder + "/along.f32");
        float[] maps = level.Reflection == null ? null : Floats(folder + "/maps.f32");
        double[][] room = null;
        if (File.Exists(folder + "/room.f32"))
        {
            float[] v = Floats(folder + "/room.f32");
            room = Enumerable.Range(0, 3).Select(i => new double[] { v[3 * i], v[3 * i + 1], v[3 * i + 2] }).ToArray();
        }
        int count = level.Layers.Count;
        int[] order = Enumerable.Range(0, count).OrderBy(i => Drawing.Queues(i, count)[1]).ToArray();
        var drawn = new float[along.Length];
        for (int p = 0; p < along.Length / 3; ++p)
        {
            var rgb = new[] { 127 / 255.0, 127 / 255.0, 127 / 255.0 };
            foreach (int i in order)
            {
                double s = st[2 * (p * count + i)], t = st[2 * (p * count + i) + 1];
                if (double.IsNaN(s)) continue;
                Layer layer = level.Layers[i];
                double[] colour = Software.Look(picture, level.Width, Within(layer.Rect, level.Colour), s, t);
                double alpha = Software.Look(picture, level.Width, Within(layer.Rect, level.Alpha), s, t)[0];
                if (maps != null)
                {
                    double[] m = Drawing.ToMaps(layer.Window, level.Reflection.Window);
                    var from = new double[] { along[3 * p], along[3 * p + 1], along[3 * p + 2] };
                    double[] added = Software.Reflected(level.Reflection, maps, from, s * m[0] + m[2], t * m[1] + m[3], room);
                    for (int c = 0; c < 3; ++c) colour[c] += added[c];
                }
                Software.Over(rgb, colour, alpha);
            }
            for (int c = 0; c < 3; ++c) drawn[3 * p + c] = (float)rgb[c];
        }
        var bytes = new byte[4 * drawn.Length];
        Buffer.BlockCopy(drawn, 0, bytes, 0, bytes.Length);
        File.WriteAllBytes(folder + "/drawn.f32", bytes);
    }

    static Rect4 Within(Rect4 rect, Rect4 half)
    {
        return new Rect4 { X = half.X + rect.X, Y = half.Y + rect.Y, Width = rect.Width, Height = rect.Height };
    }
}
