"""Columns of numbers out of text: integers, counts, ranges, and the words when something else stands there."""

import gzip
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshwright.audit.errors import ReadError
from meshwright.audit.readers import scan, source
from meshwright.audit.readers.scan import float_at, hex_at, int_at, read_all_ints, read_floats, read_ints, skip_space
from meshwright.audit.readers.source import Source, open_source


def of(text: str | bytes) -> Source:
    data = text if isinstance(text, bytes) else text.encode()
    return Source("mesh.msh", np.frombuffer(data, np.uint8))


def refusal(text: str | bytes, count: int = 1, read=read_floats, **options) -> str:
    data = of(text)
    with pytest.raises(ReadError) as caught:
        read(data, 0, len(data), count, "node", **options)
    return str(caught.value)


# --- integers ------------------------------------------------------------------------------------------------


@given(st.lists(st.integers(-(2**63), 2**63 - 1), min_size=1), st.sampled_from([" ", "\n", "\r\n", "\t", "\v\f \r"]))
@settings(max_examples=200, deadline=None)
def test_integers_of_64_bits_come_back_in_both_bases(values: list[int], space: str):
    text = space + space.join(str(v) for v in values) + space
    assert read_all_ints(of(text), 0, len(text), "id").tolist() == values
    text = space.join(f"{v:x}" for v in values)
    assert read_all_ints(of(text), 0, len(text), "id", base=16).tolist() == values
    text = space.join(f"{v:+030X}" for v in values)
    got, end = read_ints(of(text), 0, len(text), len(values), "id", base=16)
    assert (got.tolist(), end) == (values, len(text))


@given(st.text("0123456789abcdefABCDEFxX+-_. ()", max_size=25))
@settings(max_examples=500, deadline=None)
def test_integer_tokens_are_read_as_python_reads_them_or_refused(text: str):
    data = of(text + " ").data
    token = re.split(r"[ ()]", text)[0]
    for scanner, grammar, base in ((int_at, r"[+-]?[0-9]+", 10), (hex_at, r"[+-]?[0-9a-fA-F]+", 16)):
        wanted = int(token, base) if re.fullmatch(grammar, token) else None
        value, after, ok = scanner(data, 0, len(data))
        if wanted is not None and -(2**63) <= wanted < 2**63:
            assert (value, after, ok) == (wanted, len(token), True)
        else:
            assert (after, ok) == (0, False)


@pytest.mark.parametrize("token", ["1.5", "1.", "1e3", "0x10", "1_000", "1,5", "--1", "+", "-", "a", "١", "1-2", "nan"])
def test_what_is_not_an_integer_is_refused_with_its_line_and_spelling(token: str):
    message = refusal(f"1 2\r\n3 {token}\r\n", 4, read_ints)
    assert message == f"mesh.msh: line 2: expected an integer (node), found '{token}'"


def test_a_bad_hexadecimal_integer_is_called_one():
    assert refusal("1f\n1g", 2, read_ints, base=16).endswith(
        "line 2: expected a hexadecimal integer (node), found '1g'"
    )


@pytest.mark.parametrize(
    ("token", "base"),
    [
        ("9223372036854775808", 10),
        ("-9223372036854775809", 10),
        ("18446744073709551617", 10),
        ("1" + "0" * 40, 10),
        ("8000000000000000", 16),
        ("-8000000000000001", 16),
        ("10000000000000001", 16),
    ],
)
def test_integers_beyond_64_bits_are_refused(token: str, base: int):
    kind = "a hexadecimal integer" if base == 16 else "an integer"
    message = refusal(token, 1, read_ints, base=base)
    assert message == f"mesh.msh: line 1: expected {kind} of at most 64 bits (node), found '{token}'"


# --- columns -------------------------------------------------------------------------------------------------


def test_the_next_offset_lies_right_behind_the_last_number_read():
    text = "12 34\n56 (78 9)"
    values, end = read_ints(of(text), 0, len(text), 3, "id")
    assert (values.tolist(), text[end:]) == ([12, 34, 56], " (78 9)")
    values, end = read_ints(of(text), end + 2, len(text), 2, "id")
    assert (values.tolist(), text[end:]) == ([78, 9], ")")


def test_numbers_outside_the_range_are_left_alone():
    data = of("11 22 33 44")
    assert read_all_ints(data, 3, 8, "id").tolist() == [22, 33]
    assert read_all_ints(data, 2, 3, "id").tolist() == []
    assert read_floats(data, 3, 7, 2, "value")[0].tolist() == [22.0, 3.0]  # the end of the range ends a token


def test_too_few_numbers_are_counted_and_what_stands_instead_is_shown():
    text = "1 2 3\n4 5\n) end"
    with pytest.raises(ReadError, match=re.escape("line 3: expected 120 integers (id), found 5 before ') end'")):
        read_ints(of(text), 0, text.index(")"), 120, "id")
    with pytest.raises(ReadError, match=re.escape("line 2: expected 6 numbers (x), found 5 before end of file")):
        read_floats(of(text[:9]), 0, 9, 6, "x")


@pytest.mark.parametrize("read", [read_ints, read_floats])
def test_a_count_that_the_bytes_cannot_hold_costs_no_memory(read):
    assert "found 3 before end of file" in refusal("1 2 3", 10**15, read)
    assert "expected a count of numbers (node), found -1" in refusal("1 2 3", -1, read)


def test_a_parenthesis_between_integers_is_shown_where_it_stands():
    with pytest.raises(ReadError, match=re.escape("line 2: expected an integer (id), found ')'")):
        read_all_ints(of("1 2\n3 ) 4"), 0, 9, "id")
    with pytest.raises(ReadError, match=re.escape("line 1: expected an integer (id), found ')'")):
        read_all_ints(of("1 2)"), 0, 4, "id")
    with pytest.raises(ReadError, match=re.escape("line 1: expected an integer (id), found '('")):
        read_all_ints(of("1(2"), 0, 3, "id")


@pytest.mark.parametrize(("start", "stop"), [(-1, 3), (0, 6), (4, 3), (0, -1)])
def test_a_range_outside_the_file_is_never_read(start: int, stop: int):
    for call in (
        lambda: read_ints(of("1 2 3"), start, stop, 1, "id"),
        lambda: read_floats(of("1 2 3"), start, stop, 1, "x"),
        lambda: read_all_ints(of("1 2 3"), start, stop, "id"),
    ):
        with pytest.raises(ValueError, match=f"range {start} to {stop} of a source of 5 bytes"):
            call()


def test_white_space_is_the_six_ascii_kinds_and_nothing_else():
    spaces = [b for b in range(256) if skip_space(np.array([b, 65], np.uint8), 0, 2) == 1]
    assert bytes(spaces) == b"\t\n\v\f\r "


def test_scanners_stop_at_the_end_of_their_range_without_looking_further():
    data = of("1234567e55 nan").data
    assert int_at(data, 0, 3) == (123, 3, True)
    assert hex_at(data, 6, 8) == (0x7E, 8, True)
    assert float_at(data, 0, 7) == (1234567.0, 7, True)
    assert float_at(data, 0, 9) == (1234567e5, 9, True)
    assert float_at(data, 0, 8) == (0.0, 0, False)
    assert float_at(data, 11, 13) == (0.0, 11, False)
    for scanner in (int_at, hex_at, float_at):
        assert scanner(data, 3, 3)[1:] == (3, False)


def test_every_kind_of_source_is_served_by_one_compiled_version(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path = tmp_path / "numbers"
    text = b"1 2 3\n4"
    marked = b"\xef\xbb\xbf" + text
    for content, mapped_from in ((text, 1 << 20), (text, 1), (gzip.compress(text), 1 << 20), (marked, 1)):
        path.write_bytes(content)
        monkeypatch.setattr(source, "_COPIED", mapped_from)
        opened = open_source(path)
        assert read_all_ints(opened, 0, len(opened), "id").tolist() == [1, 2, 3, 4]
        assert read_floats(opened, 2, len(opened), 3, "x")[0].tolist() == [2.0, 3.0, 4.0]
    writable = Source("x", np.frombuffer(bytearray(text), np.uint8))
    assert read_floats(writable, 0, 7, 4, "x")[0].tolist() == [1.0, 2.0, 3.0, 4.0]
    assert [len(k.signatures) for k in (scan._fill_ints, scan._fill_floats, scan._count_tokens)] == [1, 1, 1]
