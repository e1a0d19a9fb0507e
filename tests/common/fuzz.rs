//! Valid files, damaged at random in a reproducible way, and what a reader may do with them:
//! refuse, or read in bounded memory.
//!
//! Each target sees [`cases`] damaged files: some thousands by default,
//! `GLASSWARP_FUZZ_CASES=1000000` for a long run, `GLASSWARP_FUZZ_FROM=500000` for the rest of one.
//! The same number always gives the same files; a failure names the case and keeps its file.

use cpu_time::ProcessTime;
use peak_alloc::PeakAlloc;
use std::{
    env, fs,
    panic::{self, AssertUnwindSafe},
    path::PathBuf,
    sync::{Mutex, MutexGuard, PoisonError},
    time::Duration,
};

/// Counts every byte of the test's process.
#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Targets take turns: memory and time are counted for the whole process.
static TURN: Mutex<()> = Mutex::new(());

/// Where the last panic was.
static PLACE: Mutex<String> = Mutex::new(String::new());

/// What a reader made of a file.
pub(crate) enum Read {
    Taken,
    Refused,
}

impl Read {
    pub(crate) fn of<T, E>(result: Result<T, E>) -> Self {
        if result.is_ok() { Self::Taken } else { Self::Refused }
    }
}

/// A reader that is tried.
pub(crate) struct Target<'a> {
    pub(crate) name: &'a str,
    /// Valid files.
    pub(crate) corpus: Vec<Vec<u8>>,
    /// Makes checksums and lengths right again, so that damage reaches what lies behind them; about
    /// every second case.
    pub(crate) mend: Option<fn(&mut Vec<u8>)>,
    /// Most memory for a file of so many bytes.
    pub(crate) memory: fn(usize) -> usize,
}

/// Waits for the turn to be measured.
pub(crate) fn turn() -> MutexGuard<'static, ()> {
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Most time of the processor, on all threads, for a file of so many bytes: a fixed part, and so
/// much for every byte.
pub(crate) fn most_time(length: usize) -> Duration {
    Duration::from_millis(250) + length as u32 * Duration::from_micros(10)
}

/// What is made of a file of so many bytes, and how much time of the processor that takes, on all
/// threads.
pub(crate) fn timed<T>(length: usize, read: impl Fn() -> T) -> (T, Duration) {
    let once = || {
        let start = ProcessTime::now();
        let made = read();
        (made, start.elapsed())
    };
    let (made, mut took) = once();
    // What another thread does meanwhile, which makes the corpus of the next target, shall not
    // count.
    for _ in 0..3 {
        if took > most_time(length) {
            took = took.min(once().1);
        }
    }
    (made, took)
}

/// Files per target.
pub(crate) fn cases(default: usize) -> usize {
    number("GLASSWARP_FUZZ_CASES").unwrap_or(default)
}

fn number(variable: &str) -> Option<usize> {
    env::var(variable).ok()?.parse().ok()
}

impl Target<'_> {
    /// Reads the corpus and `cases` damaged files, from the first on if nothing else is said.
    ///
    /// # Panics
    /// If the reader panics, takes more memory or time than it may, or refuses a file of the
    /// corpus; or if one of those is too long.
    pub(crate) fn run(&self, cases: usize, read: impl Fn(&[u8]) -> Read) {
        let _turn = turn();
        for (k, file) in self.corpus.iter().enumerate() {
            // What is cut off of every damaged file would keep all of them from being read.
            assert!(file.len() <= LONGEST, "{}: file {k} of the corpus has {} bytes", self.name, file.len());
            let (outcome, _) = self.try_one(file, &read);
            assert!(matches!(outcome, Ok(Read::Taken)), "{}: file {k} of the corpus is not taken", self.name);
        }
        // A panic is told once, with its case.
        let hook = panic::take_hook();
        panic::set_hook(Box::new(|info| {
            let place = info.location().map(ToString::to_string).unwrap_or_default();
            *PLACE.lock().unwrap_or_else(PoisonError::into_inner) = place;
        }));
        let (mut taken, mut greatest, mut slowest, mut findings) = (0, 0, (Duration::ZERO, 0), Vec::new());
        let first = number("GLASSWARP_FUZZ_FROM").unwrap_or(0);
        for case in first..first + cases {
            let file = self.damaged(case);
            let ((outcome, mut peak), took) = timed(file.len(), || self.try_one(&file, &read));
            // What another thread holds meanwhile shall not count either.
            for _ in 0..3 {
                if peak > (self.memory)(file.len()) {
                    peak = peak.min(self.try_one(&file, &read).1);
                }
            }
            slowest = slowest.max((took, case));
            greatest = greatest.max(peak);
            let finding = match outcome {
                Ok(_) if peak > (self.memory)(file.len()) => {
                    Some(format!("{peak} bytes of memory for {} bytes of file", file.len()))
                }
                Ok(_) if took > most_time(file.len()) => {
                    Some(format!("{:.2} s for {} bytes of file", took.as_secs_f64(), file.len()))
                }
                Ok(Read::Taken) => {
                    taken += 1;
                    None
                }
                Ok(Read::Refused) => None,
                Err(what) => {
                    let place = PLACE.lock().unwrap_or_else(PoisonError::into_inner);
                    Some(format!("panic: {what} at {place}"))
                }
            };
            if let Some(what) = finding {
                findings.push(format!("case {case}: {what}, kept as {}", self.keep(case, &file).display()));
                if findings.len() == 20 {
                    break;
                }
            }
        }
        panic::set_hook(hook);
        eprintln!(
            "{}: {} files in the corpus, {cases} damaged ones, {taken} of them still taken; at most {:.1} MB, {:.3} s (case {})",
            self.name,
            self.corpus.len(),
            greatest as f64 / 1e6,
            slowest.0.as_secs_f64(),
            slowest.1
        );
        assert!(findings.is_empty(), "{}:\n{}", self.name, findings.join("\n"));
    }

    /// The outcome and the most memory that was held meanwhile.
    fn try_one(&self, file: &[u8], read: &impl Fn(&[u8]) -> Read) -> (Result<Read, String>, usize) {
        MEMORY.reset_peak_usage();
        let before = MEMORY.current_usage();
        let outcome = panic::catch_unwind(AssertUnwindSafe(|| read(file)));
        let peak = MEMORY.peak_usage().saturating_sub(before);
        let said = |cause: &(dyn std::any::Any + Send)| {
            let text = cause.downcast_ref::<String>().cloned();
            text.or_else(|| cause.downcast_ref::<&str>().map(|text| (*text).to_owned())).unwrap_or_default()
        };
        (outcome.map_err(|cause| said(cause.as_ref())), peak)
    }

    fn keep(&self, case: usize, file: &[u8]) -> PathBuf {
        let folder = env::temp_dir().join("glasswarp-findings");
        let path = folder.join(format!("{}-{case}", self.name.replace([' ', '/'], "-")));
        let _ = fs::create_dir_all(&folder).and_then(|()| fs::write(&path, file));
        path
    }

    /// File number `case`: one of the corpus with one to eight wounds.
    fn damaged(&self, case: usize) -> Vec<u8> {
        let mut chance = Chance::new(case as u64);
        let mut file = self.corpus[chance.below(self.corpus.len())].clone();
        for _ in 0..=chance.few(4) {
            let donor = &self.corpus[chance.below(self.corpus.len())];
            wound(&mut file, donor, &mut chance);
        }
        if let Some(mend) = self.mend.filter(|_| chance.below(2) == 0) {
            mend(&mut file);
        }
        file
    }
}

/// Random numbers that are the same everywhere (SplitMix64).
pub(crate) struct Chance(u64);

impl Chance {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0xd134_2543_de82_ef95))
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Below `n`; 0 for no range at all.
    pub(crate) fn below(&mut self, n: usize) -> usize {
        if n == 0 { 0 } else { (self.next() % n as u64) as usize }
    }

    /// Below a power of two below this one: small numbers more often than large ones.
    fn few(&mut self, bits: usize) -> usize {
        let bits = self.below(bits);
        self.below(1 << bits)
    }
}

/// Numbers at which arithmetic goes wrong.
const WORDS: [u64; 14] = [
    0,
    1,
    2,
    0x7f,
    0x80,
    0xff,
    0x7fff,
    0x8000,
    0xffff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    0x7fff_ffff_ffff_ffff,
    0xffff_ffff_ffff_ffff,
];

/// The same as text, and other words that text formats stumble over.
const TEXTS: [&str; 22] = [
    "0",
    "-1",
    "1",
    "255",
    "65536",
    "4294967295",
    "4294967296",
    "18446744073709551616",
    "-9223372036854775809",
    "1e999",
    "-1e999",
    "1e-999",
    "nan",
    "inf",
    "-inf",
    "#0",
    "#1",
    "((((((((((((((((((((",
    "))))",
    "[[[[[[[[[[[[[[[[",
    "\"",
    "\u{fffd}\u{1f4a5}",
];

/// Most bytes of a damaged file.
const LONGEST: usize = 1 << 17;

fn wound(file: &mut Vec<u8>, donor: &[u8], chance: &mut Chance) {
    let at = chance.below(file.len() + 1);
    let length = 1 + chance.few(7);
    let end = (at + length).min(file.len());
    match chance.below(12) {
        0 | 1 => {
            if let Some(byte) = file.get_mut(at) {
                *byte ^= 1 << chance.below(8);
            }
        }
        2 => {
            if let Some(byte) = file.get_mut(at) {
                *byte = chance.next() as u8;
            }
        }
        3 | 4 => {
            let (word, size) = (WORDS[chance.below(WORDS.len())], 1 << chance.below(4));
            let bytes = if chance.below(2) == 0 {
                word.to_le_bytes()[..size].to_vec()
            } else {
                word.to_be_bytes()[8 - size..].to_vec()
            };
            if let Some(place) = file.get_mut(at..at + size) {
                place.copy_from_slice(&bytes);
            }
        }
        5 => drop(file.drain(at..end)),
        6 => {
            let piece = file[at..end].to_vec();
            let times = 1 + chance.few(8);
            file.splice(at..at, piece.repeat(times));
        }
        7 => file.truncate(at),
        8 => {
            let from = chance.below(donor.len());
            let to = (from + length).min(donor.len());
            file.splice(at..end, donor[from..to].iter().copied());
        }
        9 => {
            let bytes: Vec<u8> = (0..length).map(|_| chance.next() as u8).collect();
            file.splice(at..at, bytes);
        }
        _ => {
            // The number or word that stands here becomes another.
            let part_of_word = |byte: &u8| byte.is_ascii_alphanumeric() || b".-+#_".contains(byte);
            let begin = file[..at].iter().rposition(|byte| !part_of_word(byte)).map_or(0, |k| k + 1);
            let end = file[at..].iter().position(|byte| !part_of_word(byte)).map_or(file.len(), |k| at + k);
            if end - begin < 40 {
                file.splice(begin..end, TEXTS[chance.below(TEXTS.len())].bytes());
            }
        }
    }
    file.truncate(LONGEST);
}
