namespace Facefolds
{
    /// <summary>The asset looks to +x, up is +z, its left is +y, right-handed. Unity: it looks to +z, up is +y, its left
    /// is -x, left-handed. Nothing is mirrored to the eye.</summary>
    public static class Axes
    {
        public static double[] ToUnity(double x, double y, double z) { return new[] { -y, z, x }; }

        /// <summary>Of a rotation (w, x, y, z) of the asset's axes: (x, y, z, w) as Unity's Quaternion has it. A mirrored
        /// axis turns the sense of rotation, so that the axis changes its sign besides being moved.</summary>
        public static double[] RotationToUnity(double[] q) { return new[] { q[2], -q[3], -q[1], q[0] }; }

        /// <summary>Rows of the rotation (w, x, y, z), in the asset's axes.</summary>
        public static double[][] Matrix(double[] q)
        {
            double w = q[0], x = q[1], y = q[2], z = q[3];
            return new[]
            {
                new[] { 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y) },
                new[] { 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x) },
                new[] { 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y) },
            };
        }
    }
}
