using System;
using System.Collections.Generic;
using System.Globalization;
using System.Text;

namespace Facefolds
{
    /// <summary>A small reader of JSON: Unity's own knows no lists of lists and no keys that may be absent.
    /// Objects are dictionaries, lists are lists, numbers are doubles; the rest is string, bool and null.</summary>
    public sealed class Json
    {
        const int Deepest = 32;
        readonly string text;
        int at;
        int depth;

        Json(string text) { this.text = text; }

        /// <exception cref="FormatException">if it is not JSON; says where.</exception>
        public static object Parse(string text)
        {
            var reader = new Json(text);
            object value = reader.Value();
            reader.Space();
            if (reader.at != text.Length) throw reader.Wrong("the end");
            return value;
        }

        FormatException Wrong(string expected)
        {
            string found = at < text.Length ? "'" + text[at] + "'" : "the end";
            return new FormatException("not JSON: at character " + at + " " + expected + " was expected, not " + found);
        }

        void Space() { while (at < text.Length && " \t\r\n".IndexOf(text[at]) >= 0) ++at; }

        bool Take(char sign)
        {
            Space();
            if (at >= text.Length || text[at] != sign) return false;
            ++at;
            return true;
        }

        void Need(char sign) { if (!Take(sign)) throw Wrong("'" + sign + "'"); }

        object Value()
        {
            Space();
            if (at >= text.Length) throw Wrong("a value");
            switch (text[at])
            {
                case '{': return Nested(Object);
                case '[': return Nested(List);
                case '"': return String();
                case 't': return Word("true", true);
                case 'f': return Word("false", false);
                case 'n': return Word("null", null);
                default: return Number();
            }
        }

        object Nested(Func<object> read)
        {
            if (++depth > Deepest) throw Wrong("less nesting");
            object value = read();
            --depth;
            return value;
        }

        object Object()
        {
            var result = new Dictionary<string, object>();
            Need('{');
            if (Take('}')) return result;
            do
            {
                Space();
                string key = String();
                Need(':');
                result[key] = Value();
            } while (Take(','));
            Need('}');
            return result;
        }

        object List()
        {
            var result = new List<object>();
            Need('[');
            if (Take(']')) return result;
            do result.Add(Value()); while (Take(','));
            Need(']');
            return result;
        }

        string String()
        {
            Need('"');
            var result = new StringBuilder();
            while (at < text.Length && text[at] != '"')
            {
                char sign = text[at++];
                if (sign < ' ') throw Wrong("no control character");
                result.Append(sign == '\\' ? Escaped() : sign);
            }
            Need('"');
            return result.ToString();
        }

        char Escaped()
        {
            if (at >= text.Length) throw Wrong("a sign");
            char sign = text[at++];
            int known = "\"\\/bfnrt".IndexOf(sign);
            if (known >= 0) return "\"\\/\b\f\n\r\t"[known];
            ushort code;
            if (sign != 'u' || at + 4 > text.Length
                || !ushort.TryParse(text.Substring(at, 4), NumberStyles.HexNumber, CultureInfo.InvariantCulture, out code))
                throw Wrong("an escape");
            at += 4;
            return (char)code;
        }

        object Word(string word, object value)
        {
            if (string.CompareOrdinal(text, at, word, 0, word.Length) != 0) throw Wrong(word);
            at += word.Length;
            return value;
        }

        object Number()
        {
            int from = at;
            while (at < text.Length && "+-.eE0123456789".IndexOf(text[at]) >= 0) ++at;
            double value;
            if (!double.TryParse(text.Substring(from, at - from), NumberStyles.Float, CultureInfo.InvariantCulture, out value))
            {
                at = from;
                throw Wrong("a value");
            }
            return value;
        }
    }
}
