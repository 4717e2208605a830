"""Floats out of text: bit for bit what Python's float() makes of them, and nothing that is not a number."""

import math
import random
import re
import struct
from decimal import Decimal, localcontext
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshwright.audit.errors import ReadError
from meshwright.audit.readers import decimals
from meshwright.audit.readers.scan import float_at, read_floats, read_ints
from meshwright.audit.readers.source import Source

LARGEST = 1.7976931348623157e308
SMALLEST = 5e-324


def of(text: str | bytes) -> Source:
    data = text if isinstance(text, bytes) else text.encode()
    return Source("mesh.msh", np.frombuffer(data, np.uint8))


def floats(tokens: list[str], **options: bool) -> np.ndarray:
    """All tokens read as one column; also checks that the reader stops right behind the last."""
    text = "\n".join(tokens)
    values, end = read_floats(of(text), 0, len(text), len(tokens), "value", **options)
    assert end == len(text)
    return values


def assert_same_bits(tokens: list[str]) -> None:
    got = floats(tokens).view(np.uint64)
    wanted = np.array([float(t.lower().replace("d", "e")) for t in tokens]).view(np.uint64)
    wrong = np.flatnonzero(got != wanted)
    assert not wrong.size, [(tokens[i], hex(got[i]), hex(wanted[i])) for i in wrong[:3]]


def dice(seed: int) -> random.Random:
    return random.Random(seed)  # noqa: S311


def refusal(text: str | bytes, count: int = 1, read=read_floats, **options) -> str:
    data = of(text)
    with pytest.raises(ReadError) as caught:
        read(data, 0, len(data), count, "node", **options)
    return str(caught.value)


def halfway(low: float) -> Decimal:
    """The exact decimal halfway from a double to the next one above."""
    with localcontext(prec=1200):
        return (Decimal(low) + Decimal(math.nextafter(low, math.inf))) / 2


_HARD = """
0 -0 0.0 -0.0 0e0 0e99999 0.000e-99999 -0e5 1 -1 +1 1. .5 -.5 +5.e0 5.E+1 1d3 1D-3 00001.5 000000000000000000000001
9007199254740991 9007199254740992 9007199254740993 9007199254740994 9007199254740995 9007199254740996
9007199254740993.0 9007199254740992.999999999999999999 9007199254740993.0000000000000000000000000001
18014398509481985 18014398509481986 18014398509481987 1152921504606846976.00000000000001
562949953421312.0625 562949953421312.1875 562949953421312.0624 562949953421312.0626 1e22 1e23 -1e23 9e22 1e-22 1e-23
18446744073709551615 18446744073709551616 9223372036854775807 9999999999999999999 10000000000000000000
99999999999999999999 9999999999999999999e289 12345678901234567890123456789 0.1 0.2 0.3 0.30000000000000004
2.2250738585072011e-308 2.2250738585072012e-308 2.2250738585072014e-308 2.225073858507201136e-308
2.2250738585072013830902327173324040642192159804623318306e-308 4.9e-324 4.9406564584124654e-324 5e-324 3e-324 2.5e-324
2.4703282292062327e-324 2.4703282292062328e-324 2.470328229206232720e-324 2.4703282292062327208299493125647e-324 1e-400
7.4109846876186981626485318930233205854758970392148714663837852375101326090531312779794975454245398856969484704316857
1.7976931348623157e308 1.7976931348623158e308 1.7976931348623158079e308 -1.7976931348623157e+308 179769313486231570e291
8.5e-17 3.518437208883201171875e13 62.5364939768271845828 1.5e-320 8.10109172351e-10 6.631236846766476e-316
3.2378839133029012895883524125015321748630094440e-319 5708990770823839524233143877797980545530986496
6929495644600919.5 3.7455744005952583e15 2.2250738585072014e-307 1.3561863111827498e-309
0.000000000000000000000000000123
1448997445238699 7.2057594037927933e16 7205759403792793200001e-5 1090544144181609348671888949248 1e308 1e-307
123456e-330
9355950000000000000.00000000000000000000000000000000001844674407370955161600000184467440737095516161844674407370955161407
0.0000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000001e112
"""
HARD = _HARD.split()


def test_hard_cases_have_the_bits_of_pythons_float():
    assert_same_bits(HARD)


def test_a_million_digits_are_read_as_the_number_they_spell():
    zeros = "0" * 1_000_000
    tokens = [zeros + "1.5", "0." + zeros + "1e1000001", "1" + zeros + "e-1000000", "0." + zeros, "1." + zeros + "1"]
    assert floats(tokens).tolist() == [1.5, 1.0, 1.0, 0.0, 1.0]
    tie = "9007199254740993." + zeros
    assert floats([tie, tie + "1"]).tolist() == [9007199254740992.0, 9007199254740994.0]


def test_ties_with_few_digits_go_to_the_even_neighbour_at_every_scale():
    tokens, wanted = [], []
    for odd in range(2**53 + 1, 2**53 + 99, 2):
        even = odd + (1 if odd % 4 == 3 else -1)
        for shift in range(-8, 30):  # odd * 2**shift lies halfway between two doubles
            with localcontext(prec=60):
                tokens.append(f"{Decimal(odd) * Decimal(2) ** shift:f}")
            tokens.append(f"{odd * 2 ** (shift + 8)}e0" if shift < 0 else f"{odd * 10**shift}e-{shift}")
            wanted += [even * 2.0**shift, even * 2.0 ** (shift + 8) if shift < 0 else float(even)]
    assert floats(tokens).tolist() == wanted


def test_random_doubles_of_every_magnitude_come_back_at_any_precision():
    rng = dice(20)
    tokens = []
    for _ in range(20_000):
        (x,) = struct.unpack("<d", rng.randbytes(8))
        if math.isfinite(x):
            tokens += [repr(x), f"{x:.{rng.randrange(40)}e}", f"{rng.getrandbits(64)}e{rng.randrange(-342, 289)}"]
        tokens += [repr(rng.random()), f"{rng.uniform(-1e3, 1e3):.{rng.randrange(30)}f}"]
    assert_same_bits([t for t in tokens if math.isfinite(float(t))])


def test_halfway_points_go_to_the_even_neighbour_and_a_hair_off_decides():
    rng = dice(21)
    lows = [0.0, SMALLEST, 2.2250738585072009e-308, 2.2250738585072014e-308, 1.0, 0.1, 2.0**53, 1e22, 1e300]
    for bits in (20, 40, 52, 53, 56, 60, 62):
        lows += [struct.unpack("<d", struct.pack("<Q", rng.getrandbits(bits)))[0] for _ in range(60)]
    for low in lows:
        high = math.nextafter(low, math.inf)
        even = low if struct.unpack("<Q", struct.pack("<d", low))[0] % 2 == 0 else high
        digits, power = f"{halfway(low):e}".split("e")
        dot = "" if "." in digits else "."
        above = f"{digits}{dot}{'0' * rng.randrange(900)}1e{power}"
        below = f"{digits.rstrip('0')[:-1]}{int(digits.rstrip('0')[-1]) - 1}{dot}{'9' * rng.randrange(1, 900)}e{power}"
        assert floats([f"{digits}e{power}", below, above]).tolist() == [even, low, high], (low, digits, power)


def test_the_nearest_double_is_no_farther_than_its_neighbours():
    rng = dice(22)
    tokens = [f"{rng.getrandbits(rng.randrange(40, 130))}e{rng.randrange(-330, 260)}" for _ in range(3000)]
    for token, value in zip(tokens, floats(tokens).tolist(), strict=True):
        digits, power = token.split("e")
        exact = int(digits) * Fraction(10) ** int(power)
        miss = abs(Fraction(value) - exact)
        for neighbour in (math.nextafter(value, math.inf), math.nextafter(value, -math.inf)):
            assert math.isinf(neighbour) or miss <= abs(Fraction(neighbour) - exact), token


digits = st.text("0123456789", max_size=45)
spelled = st.builds(
    lambda sign, whole, dot, part, power: sign + whole + (dot + part if dot else "") + power,
    st.sampled_from(["", "+", "-"]),
    digits,
    st.sampled_from(["", "."]),
    digits,
    st.one_of(
        st.just(""), st.builds("{}{}{}".format, st.sampled_from("eEdD"), st.sampled_from(["", "+", "-"]), digits)
    ),
)


def python_float(token: str) -> float | None:
    """Python's reading, without what its grammar allows beyond ours; None where it is refused or overflows."""
    if not re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?", token, re.ASCII):
        return None
    value = float(re.sub("[dD]", "e", token))
    return value if math.isfinite(value) else None


@given(spelled)
@settings(max_examples=500, deadline=None)
def test_any_spelling_is_read_as_python_reads_it_or_refused(token: str):
    data = np.frombuffer((" " + token).encode(), np.uint8)
    value, after, ok = float_at(of(data.tobytes()).data, 1, len(data))
    wanted = python_float(token)
    assert ok == (wanted is not None)
    if wanted is None:
        assert after == 1
    else:
        assert after == len(data)
        assert struct.pack("<d", value) == struct.pack("<d", wanted)


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1))
@settings(max_examples=200, deadline=None)
def test_every_double_survives_being_written_and_read(values: list[float]):
    assert_same_bits([repr(v) for v in values])
    assert_same_bits([f"{v:.16E}".replace("E", "D") for v in values])


def test_nan_and_infinities_are_read_where_they_are_allowed():
    tokens = ["nan", "NaN", "-nan", "inf", "-Inf", "+INFINITY", "-infinity"]
    values = floats(tokens, finite=False)
    assert np.isnan(values[:3]).all()
    assert np.signbit(values[:3]).tolist() == [False, False, True]
    assert values[3:].tolist() == [math.inf, -math.inf, math.inf, -math.inf]


@pytest.mark.parametrize("token", ["nan", "-NaN", "Inf", "+infinity"])
def test_nan_and_infinities_are_refused_as_not_finite(token: str):
    assert refusal(f"0 1\n2 {token}\n", 4) == f"mesh.msh: line 2: expected a finite number (node), found '{token}'"


@pytest.mark.parametrize("token", ["1e309", "1e400", "-1.7976931348623159e308", "1" + "0" * 309, "9e99999999999999999"])
def test_a_float_that_overflows_is_refused(token: str):
    message = refusal(f"\n\n{token} 1", 2)
    assert message.startswith("mesh.msh: line 3: expected a number below 1.8e308 (node), found '" + token[:60])
    assert refusal(f"\n\n{token} 1", 2, finite=False) == message


def test_the_last_decimal_before_overflow_is_the_largest_double():
    with localcontext(prec=400):
        edge = Decimal(2) ** 1024 - Decimal(2) ** 970  # the halfway point to 2**1024: even, hence infinity
        assert floats([f"{edge - 1:f}", f"{edge - 1:f}.999999"]).tolist() == [LARGEST, LARGEST]
        assert "below 1.8e308" in refusal(f"{edge:f}")


_WRONG_FLOATS = """
1_000 1,5 0x1.8p3 --1 +-1 1.0.5 . - + +. .e5 e5 1e 1e+ 1e- 1e5.5 1e5e5 1.5f 1.5L 1/2 0x10 1.#INF 1.#QNAN nanx infi
infinit infinityy n i 1e5d 1-5 1+5 1:2 $1 1; '1' "1" 1e_5 - - ∞ ١٢٣ １.５ −1 [1] 1} ½ 1² nan_ @an
"""


@pytest.mark.parametrize("token", _WRONG_FLOATS.split())
def test_what_is_not_a_number_is_refused_with_its_line_and_spelling(token: str):
    assert refusal(f"1.5 2.5\n{token} 4.5\n", 4) == f"mesh.msh: line 2: expected a number (node), found '{token}'"


@pytest.mark.parametrize(
    ("token", "shown"),
    [("1\u00a02", r"1\xa02"), ("1\x002", r"1\x002"), ("\x7f", r"\x7f"), ("1\x1c2", r"1\x1c2"), ("1\x85", r"1\x85")],
)
def test_bytes_that_only_look_like_space_are_shown_escaped(token: str, shown: str):
    assert refusal(f"{token} 2", 2).endswith(f"expected a number (node), found '{shown}'")
    assert refusal(f"{token} 2", 2, read_ints).endswith(f"expected an integer (node), found '{shown}'")


def test_words_end_at_a_parenthesis_like_every_token():
    assert refusal("nan(1)").endswith("expected a finite number (node), found 'nan'")
    assert math.isnan(floats(["nan"], finite=False)[0])


def test_the_table_of_powers_of_five_holds_their_leading_128_bits():
    for q, (high, low) in enumerate(decimals._POWERS.tolist(), start=-342):
        bits = high << 64 | low
        exact = Fraction(5) ** q
        scaled = exact * Fraction(2) ** (127 - math.floor(math.log2(5) * q))
        assert 2**127 <= bits < 2**128
        assert (bits - 1 < scaled < bits) if -27 <= q < 0 else (bits <= scaled < bits + 1), q
