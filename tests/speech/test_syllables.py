"""Syllables compared with planted ones, a second implementation, the vowels of real sentences, and Praat's pitch."""

import json
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
import soundfile
from hypothesis import given, settings
from hypothesis import strategies as st
from parselmouth.praat import call
from scipy import integrate, signal, stats

from cospeech.data import tables
from cospeech.errors import UserError
from cospeech.speech import pitch, syllables

RATE = 16000
LIBRIVOX = Path(__file__).parents[3] / "shared/data/librivox"
VOWELS = {"AA", "AE", "AH", "AO", "AW", "AY", "EH", "ER", "EY", "IH", "IY", "OW", "OY", "UH", "UW"}
SENTENCES = (
    "Merhaba arkadaşlar, bugün size çok güzel bir hikaye anlatacağım.",
    "Eski zamanlarda küçük bir köyde yaşlı bir adam yaşarmış, her sabah erkenden kalkarmış.",
)
SPOKEN_VOWELS = set("aeiouyæøɛɪɯʊ")


def voiced(n, f0_hz, jitter=0.0, rng=None):
    """A voice-like train of decaying pulses; ``jitter`` is the relative deviation of its periods."""
    periods_s = np.ones(int(n / RATE * f0_hz) + 2) / f0_hz
    if jitter:
        periods_s *= 1 + jitter * rng.normal(size=len(periods_s))
    starts_s = np.cumsum(periods_s) - periods_s[0]
    time_s = np.arange(n) / RATE
    phase = time_s - starts_s[np.searchsorted(starts_s, time_s, side="right") - 1]
    return 0.3 * np.exp(-phase * 300) * np.cos(2 * np.pi * 700 * phase)


def babble(seed, seconds=1.5):
    """Stretches of voice, noise and silence at random levels, some a few frames long, some swelling."""
    rng = np.random.default_rng(seed)
    parts = []
    while sum(map(len, parts)) < seconds * RATE:
        n = int(RATE * rng.choice([0.004, 0.012, 0.03, 0.06, 0.15, 0.4]) * rng.uniform(0.7, 1.3))
        level = 10 ** rng.uniform(-2.5, 0)
        swell = 1 + 0.9 * np.sin(2 * np.pi * rng.uniform(1, 9) * np.arange(n) / RATE)
        kind = rng.choice(4, p=[0.5, 0.25, 0.15, 0.1])
        sources = (voiced(n, rng.uniform(65, 400)), 0.1 * rng.normal(size=n), 1e-3 * rng.normal(size=n), np.zeros(n))
        parts.append(sources[kind] * level * swell)
    return np.concatenate(parts)[: int(seconds * RATE)]


def columns(found):
    return np.array(found, dtype=float).reshape(-1, len(syllables.Syllable._fields))


def in_chunks(samples, sizes):
    """The syllables of a stream whose chunks have these sizes, and then the rest in one."""
    stream, found, first = syllables.Stream(RATE), [], 0
    for size in [*sizes, len(samples)]:
        found += stream.push(samples[first : first + size])
        first += size
    return columns(found + stream.finish())


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.lists(st.one_of(st.integers(1, 200), st.integers(1, 100_000)), max_size=40))
def test_chunks_of_any_size_give_the_same_syllables_to_the_last_bit(seed, sizes):
    samples = babble(seed, 1.0)
    assert in_chunks(samples, sizes).tobytes() == columns(syllables.find(samples, RATE)).tobytes()


def test_single_samples_and_chunks_longer_than_a_piece_give_the_same_syllables():
    samples = babble(1, 8.0)
    assert len(samples) > 3 * syllables.PIECE
    whole = columns(syllables.find(samples, RATE)).tobytes()
    assert in_chunks(samples, [1] * len(samples)).tobytes() == whole
    assert in_chunks(samples, [100_000]).tobytes() == whole


def reference_candidates(window):
    """Strength and pitch of unvoiced and of the four strongest peaks of the autocorrelation of a window."""
    taper = np.hanning(401)[1::2]
    window = taper * (window - window.mean())
    if (window**2).sum() <= 200 / (12 * 32768**2):
        return [(0.45, 0.0)]
    r = np.correlate(window, window, "full")[199:] / (window**2).sum()
    own = np.correlate(taper, taper, "full")[199:]
    r /= own / own[0]
    place = np.arange(6) + 0.5
    weights = np.sinc(place) * (0.5 + 0.5 * np.cos(np.pi * place / 6.5))
    fine = np.repeat(r, 2)  # at lags of half a sample
    fine[1:-1:2] = np.nan
    for lag in range(8, 68):
        fine[2 * lag + 1] = weights @ (r[lag + 1 : lag + 7] + r[lag - 5 : lag + 1][::-1]) / (2 * weights.sum())
    found = []
    for k in range(17, 135):
        if fine[k] > max(fine[k - 1], 0.225) and fine[k] >= fine[k + 1]:
            curve = np.polyfit([-1, 0, 1], fine[k - 1 : k + 2], 2)
            shift = -curve[1] / (2 * curve[0])
            f0 = 8000 / (k + shift)
            found.append((min(np.polyval(curve, shift), 1.0) + 0.01 * np.log2(f0 / 60), f0))
    return [(0.45, 0.0), *sorted(found)[-4:]]


def reference_frames(samples):
    """Level, power and pitch (0: unvoiced) of each frame, and the kinds of it and of the next two, as seen then."""
    n_frames = -(-len(samples) // 80)
    before, after = 600, 1000
    padded = np.concatenate([samples, np.zeros(80 * n_frames - len(samples) + after)])
    w = 2 * np.pi * 50 / RATE
    a = np.sin(w) / np.sqrt(2)
    y = signal.lfilter(
        [(1 + np.cos(w)) / 2, -(1 + np.cos(w)), (1 + np.cos(w)) / 2], [1 + a, -2 * np.cos(w), 1 - a], padded
    )
    y = np.concatenate([np.zeros(before), y])
    place = np.arange(-32, 33)
    taps = np.sinc(2 * 1500 / RATE * place) * np.hamming(65)
    low = np.convolve(y, taps / taps.sum(), "same")
    weights = np.exp(-0.5 * ((np.arange(55) - 27) / 12.0) ** 2)
    paths, noise, loud = [(0.0, [0.0])], -50.0, -50.0
    levels, best, silent = [], [], []
    for f in range(n_frames + 2):
        centre = before + 80 * f + 40
        bins = (y[centre - 440 : centre + 440] ** 2).reshape(55, 16).mean(axis=1)
        power = max(weights @ bins / weights.sum(), 1 / (12 * 32768**2))
        db = 10 * np.log10(power)
        noise, loud = min(noise + 0.01, db), max(loud - 0.015, db)
        silent.append(db < max(-70, noise + 8, loud - 30))
        levels.append((db, power))
        extended = []
        for strength, new in reference_candidates(low[centre - 400 : centre + 400 : 4]):
            reached = []
            for score, path in paths:
                old = path[-1]
                cost = 0.28 * ((old == 0) != (new == 0)) if old * new == 0 else 0.7 * abs(np.log2(new / old))
                reached.append((score - cost + strength, [*path[-4:], new]))
            extended.append(max(reached, key=lambda end: end[0]))
        paths = extended
        best.append(max(paths, key=lambda end: end[0])[1])
    frames = []
    for f in range(n_frames):
        seen = [0.0, 0.0, 0.0, *best[f + 2]][-3:]
        kinds = ["silent" if silent[f + i] else "voiced" if hertz else "unvoiced" for i, hertz in enumerate(seen)]
        frames.append((*levels[f], seen[0], kinds))
    return frames


def reference_pitch(hertz):
    """Mean, largest rise and largest fall of the first of the longest stretches of pitch without a jump."""
    pieces = [[]]
    for f0 in hertz:
        if not f0 or not pieces[-1] or max(f0, pieces[-1][-1]) > 1.2 * min(f0, pieces[-1][-1]):
            pieces.append([])
        if f0:
            pieces[-1].append(f0)
    f0 = np.array(max(pieces, key=len))
    changes = np.subtract.outer(f0, f0)[np.tril_indices(len(f0))]
    return f0.mean(), changes.max(), -changes.min()


def reference_rows(frames):
    """First frame, peak, end, hops heard, pitch, rise, fall and power of each syllable, from lists of all frames."""
    db, power, hertz, kinds = (list(column) for column in zip(*frames, strict=True))
    n_frames, present, stretches = len(frames), "silent", []
    for f in range(n_frames):  # a stretch goes on while one of the next three frames is of its kind
        present = present if present in kinds[f] else kinds[f][0]
        if not stretches or stretches[-1][2] != present:
            stretches.append([f, f, present])
        stretches[-1][1] = f + 1
    rows = []

    def write(first, peak, end, number, kind):
        of_pitch = reference_pitch(hertz[first:end]) if kind == "voiced" else (np.nan,) * 3
        rows.append((first, peak, end, number + 8, *of_pitch, np.mean(power[first:end])))

    first = None
    for begin, after, kind in stretches:
        if kind == "silent":
            first = None
            continue
        first, base = begin if first is None else first, begin
        for number in range(begin + 1, after):
            peak = base + int(np.argmax(db[base:number]))
            trough = peak + int(np.argmin(db[peak:number]))
            dips = min(db[peak], db[number]) >= db[trough] + 0.5 and db[number] >= max(db[trough:number])
            if dips and number >= peak + 15 and trough + 1 >= first + 8:
                write(first, peak, trough + 1, number, kind)
                first, base = trough + 1, number
            elif number == first + 200:
                write(first, peak, number, number, kind)
                first = base = number
        if after - first >= 8:
            write(first, base + int(np.argmax(db[base:after])), after, after, kind)
            first = None
    return np.array(rows, dtype=float).reshape(-1, 8)


@pytest.mark.parametrize("seed", range(25))
def test_syllables_are_those_of_a_second_implementation_that_sees_the_whole_sound(seed):
    samples = babble(seed)
    if seed == 0:  # a vowel that lasts longer than a syllable may
        samples = np.concatenate([samples, voiced(2 * RATE, 130.0)])
    expected = reference_rows(reference_frames(samples))
    n_hops = len(samples) / 80
    expected[:, 3] = np.where(expected[:, 3] > n_hops, n_hops + 1, expected[:, 3])
    found = columns(syllables.find(samples, RATE))
    assert len(found) == len(expected)
    first, peak, end, heard, *of_pitch, power = expected.T
    np.testing.assert_allclose(found[:, :4].T, [first / 200, (peak + 0.5) / 200, end / 200, heard / 200], atol=1e-12)
    np.testing.assert_allclose(found[:, 4:7].T, of_pitch, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(found[:, 7], 10 * np.log10(power), atol=1e-8)


def planted(seed):
    """Eight vowels of known pitch whose intensity peaks at known times, a hiss before the fifth, and faint noise."""
    rng = np.random.default_rng(seed)
    f0_hz = rng.uniform(80, 350)
    peaks_s = 0.4 + np.cumsum(rng.uniform(0.16, 0.35, 8))
    peaks_s[4:] += 0.3
    time_s = np.arange(int(RATE * (peaks_s[-1] + 0.5))) / RATE
    width_s = np.min(np.diff(peaks_s)) / 3.5
    envelope = sum(rng.uniform(0.5, 1) * np.exp(-0.5 * ((time_s - peak) / width_s) ** 2) for peak in peaks_s)
    hiss = np.exp(-0.5 * ((time_s - peaks_s[4] + 0.25) / 0.04) ** 2) * rng.normal(size=len(time_s))
    noise = 3e-4 * rng.normal(size=len(time_s))
    return voiced(len(time_s), f0_hz, 0.01, rng) * envelope + 0.1 * hiss + noise, peaks_s, f0_hz


@pytest.mark.parametrize("seed", range(20))
def test_planted_syllables_are_found_with_their_peaks_pitch_and_boundaries(seed):
    samples, peaks_s, f0_hz = planted(seed)
    table = syllables.table("x", syllables.find(samples, RATE))
    tables.validate(table, "syllables", "x")
    vowels, others = table[table["f0_hz"].notna()], table[table["f0_hz"].isna()]
    assert len(vowels) == 8
    assert np.abs(vowels["peak_s"] - peaks_s).max() < 0.015
    np.testing.assert_allclose(vowels["f0_hz"], f0_hz, rtol=0.01)
    assert vowels[["f0_rise_hz", "f0_fall_hz"]].to_numpy().max() < 0.05 * f0_hz
    assert (vowels["start_s"] < vowels["peak_s"]).all()
    assert (vowels["end_s"] > vowels["peak_s"]).all()
    assert (table["start_s"].to_numpy()[1:] >= table["end_s"].to_numpy()[:-1]).all()
    assert ((others["peak_s"] > peaks_s[3]) & (others["peak_s"] < peaks_s[4])).all()
    assert len(others) >= 1
    assert (table["known_s"] - table["end_s"]).max() < 0.2


def test_rise_and_fall_are_those_of_the_pitch():
    time_s = np.arange(RATE) / RATE
    f0_hz = np.interp(time_s, [0, 0.3, 0.5, 0.7, 1], [150, 150, 200, 110, 110])
    phase = np.cumsum(f0_hz) / RATE % 1.0 / f0_hz
    swell = np.clip(np.minimum(time_s - 0.25, 0.75 - time_s) / 0.05, 0, 1)
    samples = 0.3 * np.exp(-phase * 300) * np.cos(2 * np.pi * 700 * phase) * swell
    found = syllables.find(samples + 1e-4 * np.random.default_rng(0).normal(size=RATE), RATE)
    rise, fall = (max(getattr(one, name) for one in found) for name in ("f0_rise_hz", "f0_fall_hz"))
    assert rise == pytest.approx(50, abs=10)
    assert fall == pytest.approx(90, abs=15)


@pytest.mark.parametrize("seed", range(10))
def test_a_syllable_is_reported_at_the_sample_that_its_time_states_and_not_earlier(seed):
    samples = babble(seed)
    for n, syllable in enumerate(syllables.find(samples, RATE)):
        assert syllable.known_s >= syllable.end_s > syllable.start_s
        n_heard = round(syllable.known_s * RATE)
        if n_heard > len(samples):  # the end of the sound reveals it
            continue
        stream = syllables.Stream(RATE)
        earlier = stream.push(samples[: n_heard - 1])
        assert len(earlier) == n
        np.testing.assert_array_equal(columns(stream.push(samples[n_heard - 1 : n_heard]))[0], columns([syllable])[0])


def n_matched(peaks_s, vowels, tolerance_s=0.05):
    """The largest number of pairs of a vowel and a peak within it or the tolerance; each is in at most one pair."""
    open_peaks, n = sorted(peaks_s), 0
    for start, end in sorted(vowels, key=lambda vowel: vowel[1]):
        inside = [peak for peak in open_peaks if start - tolerance_s <= peak < end + tolerance_s]
        n += len(inside) > 0
        open_peaks = [peak for peak in open_peaks if peak not in inside[:1]]
    return n


def read_sentence(path):
    words = json.loads(path.with_suffix(".phone.json").read_text())["w"]
    phones = [phone for word in words for phone in word["w"]]
    vowels = [(phone["b"], phone["b"] + phone["d"]) for phone in phones if phone["t"] in VOWELS]
    return *soundfile.read(path), vowels


@pytest.mark.recorded
@pytest.mark.skipif(not LIBRIVOX.is_dir(), reason="needs the real recordings in ../shared/data/librivox")
def test_syllables_of_read_sentences_are_their_vowels_and_are_known_soon():
    n_right = n_found = n_true = 0
    delays_s, semitones, agreed = [], [], []
    for path in sorted(LIBRIVOX.glob("*.wav")):
        samples, rate, vowels = read_sentence(path)
        table = syllables.table(path.stem, syllables.find(samples, rate))
        found = table[table["f0_hz"].notna()]
        n_right += n_matched(found["peak_s"], vowels)
        n_found, n_true = n_found + len(found), n_true + len(vowels)
        delays_s += list(found["known_s"] - found["peak_s"])
        track = pitch.table(pitch.track(samples, rate))
        for row in table.itertuples():
            praat = track["f0_hz"][track["time_s"].between(row.start_s, row.end_s)]
            agreed.append((praat.notna().mean() > 0.5) == (row.f0_hz == row.f0_hz))
            if row.f0_hz == row.f0_hz and praat.notna().any():
                semitones.append(abs(12 * np.log2(row.f0_hz / praat.mean())))
    assert 2 * n_right / (n_found + n_true) >= 0.82  # measured 0.89
    assert np.median(delays_s) <= 0.150  # measured 0.137; 0.203 at the 90th percentile
    assert np.median(semitones) < 0.1  # measured 0.05
    assert np.mean(np.array(semitones) > 12 * np.log2(1.2)) < 0.02  # measured 0
    assert np.mean(agreed) > 0.85


@pytest.mark.parametrize("voice", ["Female1", "Male1"])
def test_syllables_of_synthesised_speech_are_its_vowels(voice):
    synthesiser = call("Create SpeechSynthesizer", "Turkish", voice)
    call(synthesiser, "Speech output settings", RATE, 0.01, 1.0, 1.0, 175, "IPA")
    n_right = n_found = n_true = 0
    for sentence in SENTENCES:
        grid, sound = call(synthesiser, "To Sound", sentence, "yes")
        phones = [
            (*(call(grid, f"Get {edge} time of interval", 4, n) for edge in ("start", "end")), label)
            for n in range(1, call(grid, "Get number of intervals", 4) + 1)
            if (label := call(grid, "Get label of interval", 4, n))
        ]
        vowels = [phone[:2] for phone in phones if phone[2][0] in SPOKEN_VOWELS]
        noise = 1e-3 * np.random.default_rng(0).normal(size=sound.values.shape[1])
        found = [one for one in syllables.find(sound.values[0] + noise, RATE) if one.f0_hz == one.f0_hz]
        n_right += n_matched([one.peak_s for one in found], vowels)
        n_found, n_true = n_found + len(found), n_true + len(vowels)
    assert 2 * n_right / (n_found + n_true) > 0.85  # bench/syllables.py, 8 voices: 0.92 to 0.97


def test_an_hour_of_noise_or_silence_has_no_syllables_and_takes_constant_memory():
    stream = syllables.Stream(RATE)
    noise, silence = 3e-4 * np.random.default_rng(0).normal(size=10 * RATE), np.zeros(10 * RATE)
    stream.push(noise)
    tracemalloc.start()
    found = [stream.push(chunk) for chunk in [noise] * 60 + [silence] * 300]
    peak_bytes = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert not any(found)
    assert peak_bytes < 100_000
    after = syllables.Stream(RATE)
    speech = planted(0)[0]
    heard, fresh = (
        [(one.end_s - one.start_s, one.f0_hz > 0) for one in s.push(speech) + s.finish()] for s in (stream, after)
    )
    assert [kind for _, kind in heard] == [kind for _, kind in fresh]


def test_louder_noise_is_soon_taken_for_noise_and_a_steady_tone_too():
    noise = 1e-3 * np.random.default_rng(0).normal(size=40 * RATE)
    noise[20 * RATE :] *= 10
    assert all(19.9 < one.start_s < 28 for one in syllables.find(noise, RATE))
    tone = 0.05 * np.sign(np.sin(2 * np.pi * 120 * np.arange(30 * RATE) / RATE))
    assert all(one.end_s < 10 for one in syllables.find(tone, RATE))


def test_offset_and_level_hardly_change_the_syllables():
    samples = planted(3)[0]
    plain, shifted, soft = (columns(syllables.find(s, RATE)) for s in (samples, samples + 0.1, 0.1 * samples))
    for other in (shifted, soft):
        assert other.shape == plain.shape
        np.testing.assert_allclose(other[:, [1, 4]], plain[:, [1, 4]], rtol=0.01)
    np.testing.assert_allclose(shifted, plain, atol=0.05, rtol=0.01)
    np.testing.assert_allclose(soft[:, 7], plain[:, 7] - 20, atol=1.0)  # the first one begins later


def test_samples_that_are_not_finite_count_as_zero_and_loud_ones_are_clipped():
    samples = planted(5)[0]
    broken, mended = samples.copy(), samples.copy()
    broken[5000:5100], mended[5000:5100] = np.nan, 0
    broken[9000], mended[9000] = np.inf, 0
    broken[12000], mended[12000] = 1e30, 1
    assert columns(syllables.find(broken, RATE)).tobytes() == columns(syllables.find(mended, RATE)).tobytes()
    assert len(syllables.find(np.clip(50 * samples, -1, 1), RATE)) > 0
    assert syllables.find(np.full(RATE, np.nan), RATE) == []


def test_single_precision_is_accepted():
    samples = planted(2)[0].astype(np.float32)
    single, double = (columns(syllables.find(s, RATE)) for s in (samples, samples.astype(float)))
    np.testing.assert_array_equal(single, double)


def test_another_rate_integers_and_several_channels_are_rejected():
    with pytest.raises(UserError, match="44100 Hz; resample it to 16000 Hz"):
        syllables.Stream(44100)
    for wrong in (np.zeros(100, np.int16), np.zeros((100, 2))):
        with pytest.raises(UserError, match="one channel of floating-point samples"):
            syllables.Stream(RATE).push(wrong)


@pytest.mark.parametrize("n", [0, 1, 79, 80, 81, 4000])
def test_short_sounds_end_where_they_end(n):
    found = syllables.find(voiced(n, 150.0), RATE)
    assert len(found) == (n == 4000)  # the others are shorter than a syllable
    for one in found:
        assert one.peak_s <= one.end_s <= n / RATE < one.known_s == n / RATE + 0.005
    table = syllables.table("x", found)
    tables.validate(table, "syllables", "x")


@pytest.mark.parametrize(("mean", "deviation"), [(150.0, 20.0), (60.0, 5.0), (700.0, 100.0), (220.0, 400.0)])
def test_the_pitch_of_unvoiced_syllables_is_integrated_out_over_its_range(mean, deviation):
    low, high = syllables.UNVOICED_HZ
    expected = integrate.quad(lambda hertz: stats.norm.pdf(hertz, mean, deviation) / (high - low), low, high)[0]
    assert syllables.unvoiced_density(mean, deviation) == pytest.approx(expected, rel=1e-9)


def test_voiced_pitch_lies_in_the_range_of_unvoiced_pitch():
    low, high = syllables.UNVOICED_HZ
    found = [one.f0_hz for seed in range(5) for one in syllables.find(babble(seed), RATE) if one.f0_hz == one.f0_hz]
    assert len(found) > 5
    assert low - 1 < min(found) < max(found) < high + 10
