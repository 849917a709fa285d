using System;

namespace Facefolds
{
    /// <summary>In what order layers are drawn, and where a layer's texels lie: what the shader gets as numbers.</summary>
    public static class Drawing
    {
        public const int FirstQueue = 3000; // Unity's "Transparent"

        /// <summary>Render queues of a layer's two materials, depth alone and then colour. Layers are drawn by their index
        /// and never by distance: the innermost, which is the last, first.</summary>
        public static int[] Queues(int index, int count)
        {
            int first = FirstQueue + 2 * (count - 1 - index);
            return new[] { first, first + 1 };
        }

        /// <summary>(s, t) -> texture coordinates of the whole picture, v up: times the first two, plus the last two.</summary>
        public static double[] InPicture(Rect4 rect, Rect4 half, int width, int height)
        {
            double x = half.X + rect.X, y = half.Y + rect.Y;
            return new[] { rect.Width / width, -rect.Height / height, x / width, 1 - y / height };
        }

        /// <summary>(s, t) of a layer -> (s, t) of the reflection's maps: times the first two, plus the last two.</summary>
        public static double[] ToMaps(double[] layer, double[] maps)
        {
            double height = maps[1] - maps[0], width = maps[3] - maps[2];
            return new[]
            {
                (layer[3] - layer[2]) / width, (layer[1] - layer[0]) / height,
                (layer[2] - maps[2]) / width, (maps[1] - layer[1]) / height,
            };
        }
    }

    /// <summary>What the shaders compute, in plain C#: to test it against the reference renderer without a graphics card.</summary>
    public static class Software
    {
        /// <summary>Bilinear, clamped to the rectangle; (s, t) within it, t down. pixels: rows of RGB in [0, 1].</summary>
        public static double[] Look(float[] pixels, int width, Rect4 rect, double s, double t)
        {
            double x = rect.X + Math.Min(rect.Width - 0.5, Math.Max(0.5, s * rect.Width)) - 0.5;
            double y = rect.Y + Math.Min(rect.Height - 0.5, Math.Max(0.5, t * rect.Height)) - 0.5;
            int right = (int)(rect.X + rect.Width) - 1, bottom = (int)(rect.Y + rect.Height) - 1;
            int j = Math.Min((int)Math.Floor(x), right), i = Math.Min((int)Math.Floor(y), bottom);
            double a = x - j, b = y - i;
            var result = new double[3];
            for (int c = 0; c < 3; ++c)
                for (int k = 0; k < 4; ++k)
                {
                    int row = Math.Min(i + k / 2, bottom), column = Math.Min(j + k % 2, right);
                    double weight = (k / 2 == 0 ? 1 - b : b) * (k % 2 == 0 ? 1 - a : a);
                    result[c] += weight * pixels[3 * (row * width + column) + c];
                }
            return result;
        }

        /// <summary>What the reflection adds to a colour.</summary>
        /// <param name="along">unit vector from the eye to the point, in the meshes' own axes.</param>
        /// <param name="toRoom">rows of the rotation from those axes to the room's; null: none.</param>
        public static double[] Reflected(Reflection one, float[] pixels, double[] along, double s, double t, double[][] toRoom)
        {
            double[] code = Look(pixels, one.Width, one.Normals, s, t);
            var n = new[] { 2 * code[0] - 1, 2 * code[1] - 1, 2 * code[2] - 1 };
            double length = Math.Sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
            double towards = Math.Min(0, (along[0] * n[0] + along[1] * n[1] + along[2] * n[2]) / length);
            var r = new double[3];
            for (int i = 0; i < 3; ++i) r[i] = along[i] - 2 * towards * n[i] / length;
            if (toRoom != null)
            {
                var turned = new double[3];
                for (int i = 0; i < 3; ++i)
                    for (int k = 0; k < 3; ++k) turned[i] += toRoom[i][k] * r[k];
                r = turned;
            }
            double scale = 0.5 / Math.Sqrt(Math.Max(2 * (1 + r[0]), 1e-6));
            double[] light = Look(pixels, one.Width, one.Environment, 0.5 + scale * r[1], 0.5 - scale * r[2]);
            double gloss = one.GlossScale * Look(pixels, one.Width, one.Gloss, s, t)[0];
            double[] offset = Look(pixels, one.Width, one.Offset, s, t);
            var added = new double[3];
            for (int i = 0; i < 3; ++i) added[i] = gloss * one.EnvironmentScale * light[i] - one.OffsetScale * (2 * offset[i] - 1);
            return added;
        }

        /// <summary>One layer over what lies behind it: stored values, straight alpha.</summary>
        public static void Over(double[] behind, double[] colour, double alpha)
        {
            for (int i = 0; i < 3; ++i) behind[i] = alpha * Math.Min(1, Math.Max(0, colour[i])) + (1 - alpha) * behind[i];
        }
    }
}
