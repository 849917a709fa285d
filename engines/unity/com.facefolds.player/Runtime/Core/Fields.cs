using System;
using System.Collections.Generic;
using System.Linq;

namespace Facefolds
{
    /// <summary>An object of the manifest, read key by key. What is not asked for is passed over: a later writer may
    /// have added it. What is asked for and missing is said, with its place.</summary>
    public sealed class Fields
    {
        readonly Dictionary<string, object> values;
        readonly string place;

        public Fields(object value, string place)
        {
            values = value as Dictionary<string, object>;
            this.place = place;
            if (values == null) throw new FormatException(place + " is not an object");
        }

        public bool Has(string key) { return values.ContainsKey(key) && values[key] != null; }

        object Get(string key)
        {
            if (!Has(key)) throw new FormatException(Place(key) + " is missing");
            return values[key];
        }

        string Place(string key) { return place == "" ? key : place + "." + key; }

        T As<T>(string key, string kind)
        {
            object value = Get(key);
            if (!(value is T)) throw new FormatException(Place(key) + " is not " + kind);
            return (T)value;
        }

        public string Text(string key) { return As<string>(key, "text"); }

        public double Number(string key) { return As<double>(key, "a number"); }

        public int Whole(string key)
        {
            double value = Number(key);
            if (value != Math.Floor(value) || Math.Abs(value) > int.MaxValue)
                throw new FormatException(Place(key) + " is not a whole number");
            return (int)value;
        }

        public Fields Object(string key) { return new Fields(Get(key), Place(key)); }

        public List<Fields> Objects(string key)
        {
            return As<List<object>>(key, "a list").Select((value, i) => new Fields(value, Place(key) + "[" + i + "]")).ToList();
        }

        /// <summary>A list of that many numbers.</summary>
        public double[] Numbers(string key, int count)
        {
            List<object> list = As<List<object>>(key, "a list");
            if (list.Count != count || !list.All(value => value is double))
                throw new FormatException(Place(key) + " is not a list of " + count + " numbers");
            return list.Cast<double>().ToArray();
        }
    }
}
