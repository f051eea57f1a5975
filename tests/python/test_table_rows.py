"""Tables are read alike in all forms, and refused for the same errors, as by the program's reader (tests/calibration/table_contract_test.cpp)."""

import random
import unittest

import numpy as np
from tricoil._table_rows import Table, cell_number, cells_of, plain_numbers, separator_of

PLAIN = [["x", "y", "z"], ["0.5", "-2", "1e-3"], ["1.25", "+7", "0"], ["3", ".5", "-1."]]
NUMBERS = np.array([[0.5, -2, 1e-3], [1.25, 7, 0], [3, 0.5, -1]])


class Bytes:
    """A file that gives so many bytes at a time."""

    path = "t.csv"

    def __init__(self, data, count):
        self.parts = [data[n:n + count] for n in range(0, len(data), count)]

    def read(self):
        return self.parts.pop(0) if self.parts else b""


def table_of(data, count=1 << 20):
    stream = Bytes(data, count)
    return Table(stream, b"".join(stream.read() for _ in range(8)) if count < 8 else stream.read())


def read(data, names=("x", "y", "z"), count=1 << 20, limits=None):
    table = table_of(data, count)
    columns = [table.column(name, "x,y,z") for name in names] if names else range(3)
    parts, lines = [], []
    while (rows := table.next()) is not None:
        parts.append(np.column_stack(table.numbers(rows, [(column, limits) for column in columns])))
        lines.extend(rows.lines)
    return np.concatenate(parts) if parts else np.empty((0, 3)), lines


def joined(rows, separator=","):
    return "".join(separator.join(row) + "\n" for row in rows)


def quoted(rows):
    return [[f' "{cell}" ' for cell in row] for row in rows]


TEXT = joined(PLAIN)
FORMS = {
    "plain": TEXT.encode(),
    "byte-order mark": b"\xef\xbb\xbf" + TEXT.encode(),
    "CRLF": TEXT.replace("\n", "\r\n").encode(),
    "no last line feed": TEXT[:-1].encode(),
    "blanks": TEXT.replace(",", " , ").encode(),
    "semicolons": joined(PLAIN, ";").encode(),
    "tabs": joined(PLAIN, "\t").encode(),
    "only blanks": joined(PLAIN, "  ").encode(),
    "decimal comma, semicolons": joined(PLAIN, "; ").replace(".", ",").encode(),
    "decimal comma, tabs": joined(PLAIN, "\t").replace(".", ",").encode(),
    "decimal comma, blanks": joined(PLAIN, " ").replace(".", ",").encode(),
    "decimal comma in quotation marks": joined(quoted(PLAIN)).replace(".", ",").encode(),
    "quotation marks": joined(quoted(PLAIN)).encode(),
    "comments": b"# operator A, 3 mm\n" + joined(PLAIN[:1]).encode() + b"  # pause, again\n" + joined(PLAIN[1:]).encode(),
    "blank lines": b"\n \t\n" + joined(PLAIN[:1]).encode() + b"\n" + joined(PLAIN[1:]).encode() + b"\n\r\n",
    "empty rows": b",,\n" + TEXT.encode() + b",,\n,,\n",
    "other order": joined([row[::-1] for row in PLAIN]).encode(),
    "empty cells at the end": TEXT.replace("\n", ",,\n").encode(),
    "UTF-16": b"\xff\xfe" + joined(PLAIN, "\t").replace("\n", "\r\n").encode("utf-16-le"),
    "UTF-16, high byte first": b"\xfe\xff" + TEXT.encode("utf-16-be"),
}


class Tables(unittest.TestCase):
    def test_read_alike_in_all_forms(self):
        for form, data in FORMS.items():
            for count in (1 << 20, 1, 7):
                with self.subTest(form, count=count):
                    np.testing.assert_array_equal(read(data, count=count)[0], NUMBERS)

    def test_without_names(self):
        numbers, lines = read(joined(PLAIN[1:], " ").encode(), names=None)
        np.testing.assert_array_equal(numbers, NUMBERS)
        self.assertEqual(lines, [1, 2, 3])

    def test_lines_are_numbered_as_in_the_file(self):
        for count in (1 << 20, 1):
            self.assertEqual(read(b"x,y,z\n\n1,2,3\n# a\n4,5,6\n", count=count)[1], [3, 5])

    def refused(self, text, says, **options):
        for count in (1 << 20, 5):
            with self.assertRaises(ValueError) as raised:
                read(text if isinstance(text, bytes) else text.encode(), count=count, **options)
            self.assertTrue(str(raised.exception).startswith("t.csv:" + says), str(raised.exception))

    def test_errors_name_line_and_column(self):
        for cell in ("abc", "1.2.3", "+-1", '"1"2', "1_000", "0x10", "\u0661"):
            self.refused(f"x,y,z\n1,2,3\n4,5,{cell}\n", f"3: z: '{cell if cell.isascii() else '?'}' is not a number")
        self.refused("x;y;z\n1;2;1.234,5\n", "2: z: '1.234,5' is not a number")
        for cell in ("nan", "inf", "-INF"):
            self.refused(f"x,y,z\n1,{cell},3\n", f"2: y: '{cell}' is not finite; remove or repair the line")
        self.refused("x,y,z\n1,2,3\n4,5\n", "3: 2 columns; 3 are needed, as in line 1")
        self.refused("x,y,z\n1,2,3\n1,2,3,4\n5,6\n", "3: 4 columns; 3 are needed")
        self.refused("x,y,z\n1,2,3\n1,2\n3,4,5,6\n", "3: 2 columns; 3 are needed")
        self.refused("1,2,3\n4,5,6\n", "1: has numbers; the header must have x,y,z")
        self.refused("x,y,other\n1,2,3\n", "1: no column z; the header must have x,y,z")
        self.refused("x,y,z,z\n1,2,3,3\n", "1: more than one column z; the header must have x,y,z")
        self.refused("x,y,z\n1,2,2.5\n", "2: z: 2.5 is not a whole number from 0 to 9", limits=(0, 9))
        self.refused("x,y,z\n1,2,10\n", "2: z: 10 is not a whole number from 0 to 9", limits=(0, 9))
        self.refused("x,y,z\n1,2,3\n4,\0,6\n", "3: binary data; a text file is needed")
        self.refused("# only\n\n", " is empty; a table is needed")

    def test_the_first_wrong_row_is_named(self):
        self.refused("x,y,z\n1,2,3\n4,5,a\nb,5,6\n", "3: z: 'a'")

    def test_a_line_without_an_end_is_refused(self):
        with self.assertRaisesRegex(ValueError, "t.csv:2: the line is longer than 1 MiB; a text file is needed"):
            read(b"x,y,z\n" + b"1" * ((1 << 20) + 1))

    def test_random_texts_are_read_or_refused(self):
        random.seed(5)
        for _ in range(3000):
            text = "".join(random.choice('1,;\t "#x.\n\r-e\0') for _ in range(random.randrange(40)))
            try:
                read(b"x,y,z\n" + text.encode(), count=random.choice((3, 1 << 20)))
            except ValueError as error:
                self.assertRegex(str(error), r"^t\.csv:")


class Plain(unittest.TestCase):
    def test_numbers(self):
        for text, separator, expected in ((b"1,2.5\n-3,4e1\n", ",", [[1, 2.5], [-3, 40]]), (b"1;2,5\r\n3;4\r\n", ";", [[1, 2.5], [3, 4]]),
                                          (b" 1  2\n3 4 \n", " ", [[1, 2], [3, 4]]), (b"+1\t.5", "\t", [[1, 0.5]])):
            np.testing.assert_array_equal(plain_numbers(text, separator, 2, None), expected)

    def test_anything_else_is_left_to_the_rules(self):
        for text in (b"", b"1,2\n\n3,4\n", b"1,2\n3\n", b"1,2,3\n4\n", b"1\n2,3,4\n", b"1,\n2,3\n", b"1,2\n#3,4\n", b"1,x\n", b"1,nan\n", b'1,"2"\n', b"1,2-3\n",
                     b"1,+-2\n", b"1,2.3.4\n", b"1,1_0\n", b"1,2e\n", b"1, 2\n"):
            self.assertIsNone(plain_numbers(text, ",", 2, None), text)
        for text in (b"1 2 3\n4\n", b"1\n2 3 4\n", b"1 2\n\n3 4\n"):
            self.assertIsNone(plain_numbers(text, " ", 2, None), text)

    def test_states(self):
        np.testing.assert_array_equal(plain_numbers(b"5,S1\n6,S3\n", ",", 2, 1), [[5, 1], [6, 3]])
        np.testing.assert_array_equal(plain_numbers(b"S1 5\nS4 6", " ", 2, 0), [[1, 5], [4, 6]])
        for text in (b"S1,2\n1,3\n", b"S1,2\n3,S1\n", b"S11,2\n", b"S,2\n", b"SS,2\n", b"S1.0,2\n"):
            self.assertIsNone(plain_numbers(text, ",", 2, 0), text)


class Cells(unittest.TestCase):
    def test_separator(self):
        for row, separator in (("a,b", ","), ("a;b,c", ";"), ("a\tb c", "\t"), ("a b", " "), ("0,5 0,25", " "), ("a", " "), ("1, 2", ","), ('"a,b";c', ";")):
            self.assertEqual(separator_of(row), separator, row)

    def test_quotation_marks(self):
        self.assertEqual(cells_of(' "a,b" , c,"",', ","), ["a,b", "c", "", ""])
        self.assertEqual(cells_of('"a b"  c ', " "), ["a b", "c"])
        self.assertEqual(cells_of('"a', ","), ['"a'])

    def test_numbers(self):
        self.assertEqual([cell_number(text) for text in ("1", "+1", "0,5", "1,5e2", "1,2.3", "", "e5", "-", "1e", " 1")],
                         [1, 1, 0.5, 150, None, None, None, None, None, None])


if __name__ == "__main__":
    unittest.main()
