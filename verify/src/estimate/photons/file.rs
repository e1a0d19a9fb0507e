//! Tallies as files, so that parts of a run can be computed on many machines.
//!
//! A tally is an OpenEXR file. Channels of 32-bit unsigned integers hold the exact sums, least
//! significant word first: `sum.0`, `sum.1` every pixel's power in units of 2^-32 of a photon's,
//! `square.0` to `square.3` the sum over replicates of its square. The channels `Y` (irradiance)
//! and `noise` (its standard error) hold what follows from them in single precision, for viewers.
//! What else belongs to a tally stands in the attribute `comments`, as text.

use super::tally::{MOST_REPLICATES, MOST_STRATA, PhotonTally};
use crate::{
    estimate::flux::PowerTally,
    image_file::{ImageFileError, read_exr_layer, write_whole},
};
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, ImageAttributes, Layer,
    LayerAttributes, LineOrder, Text, WritableImage,
};
use std::{
    collections::HashMap,
    fs,
    io::Cursor,
    path::{Path, PathBuf},
};

/// Why a file gives no tally.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TallyError {
    /// The file system refused.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Not a tally, or a damaged one.
    #[error("{} is no photon tally: {reason}", path.display())]
    Malformed {
        /// Which file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
}

/// First line of the comment.
const KIND: &str = "glasswarp photon tally, version 2";

impl PhotonTally {
    /// Writes the tally. `bench` says, in one line, what was looked at: parts of different benches
    /// must not be merged. Equal tallies give equal files, byte by byte.
    ///
    /// # Errors
    /// See [`ImageFileError`].
    pub fn write(&self, path: &Path, bench: &str) -> Result<(), ImageFileError> {
        let failed = |reason: String| ImageFileError::Encode { path: path.into(), reason };
        let integers = |name: &str, words: usize, of: &[u128]| -> Vec<AnyChannel<FlatSamples>> {
            let word = |w: usize| FlatSamples::U32(of.iter().map(|v| (v >> (32 * w)) as u32).collect());
            (0..words).map(|w| AnyChannel::new(format!("{name}.{w}").as_str(), word(w))).collect()
        };
        let floats = |name: &str, of: &crate::image::Image| {
            AnyChannel::new(name, FlatSamples::F32(of.values.iter().map(|&v| v as f32).collect()))
        };
        let mut channels = integers("sum", SUM_WORDS, &self.sums);
        channels.extend(integers("square", SQUARE_WORDS, &self.squares));
        channels.push(floats("Y", &self.image()));
        channels.push(floats("noise", &self.standard_error()));
        let comment = self.describe(bench);
        let attributes = LayerAttributes {
            comments: Some(Text::new_or_none(&comment).ok_or_else(|| failed("the bench is not in Latin-1".into()))?),
            ..LayerAttributes::named("photons")
        };
        // Blocks in order and one after the other: the same bytes every time.
        let encoding =
            Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
        let layer = Layer::new(self.pixels, attributes, encoding, AnyChannels::sort(channels.into_iter().collect()));
        let mut bytes = Cursor::new(Vec::new());
        Image::new(ImageAttributes::with_size(self.pixels), layer)
            .write()
            .non_parallel()
            .to_buffered(&mut bytes)
            .map_err(|error| failed(error.to_string()))?;
        write_whole(path, bytes.get_ref())
    }

    /// Reads a tally and the bench that it belongs to.
    ///
    /// # Errors
    /// See [`TallyError`].
    pub fn read(path: &Path) -> Result<(Self, String), TallyError> {
        let bytes = fs::read(path).map_err(|source| TallyError::Read { path: path.into(), source })?;
        Self::parse(&bytes).map_err(|reason| TallyError::Malformed { path: path.into(), reason })
    }

    /// The same from memory.
    ///
    /// # Errors
    /// What is wrong with the file.
    pub fn parse(bytes: &[u8]) -> Result<(Self, String), String> {
        parse(bytes)
    }

    fn describe(&self, bench: &str) -> String {
        let done: Vec<String> = self.done.iter().map(u32::to_string).collect();
        let lines = [
            ("bench", bench.replace(['\n', '\r'], " ")),
            ("seed", self.seed.to_string()),
            ("strata", format!("{} {}", self.strata.0, self.strata.1)),
            ("replicates", self.replicates.to_string()),
            ("done", done.join(" ")),
            ("light", if self.is_even() { "even" } else { "uneven" }.to_owned()),
            ("fates", self.fates.words().map(|units| units.to_string()).join(" ")),
        ];
        lines.iter().fold(KIND.to_owned(), |text, (key, value)| format!("{text}\n{key} = {value}"))
    }
}

/// 32-bit words of a sum: fewer than 2^32 photons of 2^32 units each.
const SUM_WORDS: usize = 2;
/// 32-bit words of a square.
const SQUARE_WORDS: usize = 4;

fn parse(bytes: &[u8]) -> Result<(PhotonTally, String), String> {
    let layer = read_exr_layer(bytes).map_err(|error| error.to_string())?;
    let comment = layer.attributes.comments.as_ref().map(ToString::to_string).unwrap_or_default();
    let mut lines = comment.lines();
    if lines.next() != Some(KIND) {
        return Err(format!("its comment does not begin with '{KIND}'"));
    }
    let values: HashMap<&str, &str> = lines.filter_map(|line| line.split_once(" = ")).collect();
    let text = |key: &str| values.get(key).copied().ok_or_else(|| format!("its comment does not give '{key}'"));
    fn numbers<T: std::str::FromStr>(key: &str, text: &str) -> Result<Vec<T>, String> {
        let number = |word: &str| word.parse().map_err(|_| format!("its '{key}' holds '{word}'"));
        text.split_whitespace().map(number).collect()
    }
    let fixed = |key: &str, count: usize| -> Result<Vec<u128>, String> {
        let found = numbers(key, text(key)?)?;
        if found.len() == count { Ok(found) } else { Err(format!("its '{key}' holds {} numbers", found.len())) }
    };
    let small = |value: u128| u32::try_from(value).map_err(|_| format!("{value} is too large"));
    let (strata, fates) = (fixed("strata", 2)?, fixed("fates", 7)?);
    let words = |name: &str, count: usize| -> Result<Vec<u128>, String> {
        let mut sums = vec![0; layer.size.area()];
        for w in 0..count {
            let channel_name = format!("{name}.{w}");
            let channel = layer.channel_data.list.iter().find(|channel| channel.name == *channel_name.as_str());
            match channel.map(|channel| &channel.sample_data) {
                Some(FlatSamples::U32(samples)) if samples.len() == sums.len() => {
                    sums.iter_mut().zip(samples).for_each(|(sum, &s)| *sum |= u128::from(s) << (32 * w));
                }
                _ => return Err(format!("it has no channel '{channel_name}' of 32-bit integers")),
            }
        }
        Ok(sums)
    };
    let seed = fixed("seed", 1)?[0];
    let tally = PhotonTally {
        seed: u64::try_from(seed).map_err(|_| format!("{seed} is no seed"))?,
        strata: (small(strata[0])?, small(strata[1])?),
        pixels: (layer.size.0, layer.size.1),
        replicates: small(fixed("replicates", 1)?[0])?,
        done: numbers("done", text("done")?)?,
        fates: PowerTally::of_words(fates.try_into().map_err(|_| "its fates are not seven".to_owned())?),
        sums: words("sum", SUM_WORDS)?,
        squares: words("square", SQUARE_WORDS)?,
    };
    let even = match values.get("light") {
        None | Some(&"even") => true,
        Some(&"uneven") => false,
        Some(other) => return Err(format!("its 'light' is '{other}'")),
    };
    check(&tally, even)?;
    Ok((tally, text("bench")?.to_owned()))
}

/// Every photon's power is somewhere, if all have the same, and the pixels hold what is said to
/// have met the window.
fn check(tally: &PhotonTally, even: bool) -> Result<(), String> {
    let ascending = tally.done.windows(2).all(|pair| pair[0] < pair[1]);
    let last = tally.done.last().copied().unwrap_or(u32::MAX);
    if !ascending || last >= tally.replicates || tally.replicates > MOST_REPLICATES {
        return Err("its list of replicates makes no sense".into());
    }
    let (columns, rows) = tally.strata;
    if columns.max(rows) > MOST_STRATA {
        return Err(format!("{columns} x {rows} strata are more than there can be"));
    }
    let recorded = tally.fates.words().iter().try_fold(0u128, |sum, &units| sum.checked_add(units));
    if recorded.is_none() || tally.is_even() != even {
        return Err(format!("{} photons do not account for its fates", tally.photons()));
    }
    if tally.sums.iter().sum::<u128>() != tally.fates.window {
        return Err("its pixels do not hold the light that met the window".into());
    }
    // By Cauchy and Schwarz; what violates it has been damaged, and would have a negative variance.
    let n = tally.done.len() as u128;
    let sound = |(&sum, &square): (&u128, &u128)| {
        square <= sum * sum && n.checked_mul(square).is_some_and(|spread| spread >= sum * sum)
    };
    if !tally.sums.iter().zip(&tally.squares).all(sound) {
        return Err("its squares do not fit its sums".into());
    }
    Ok(())
}

impl PowerTally {
    fn words(&self) -> [u128; 7] {
        [self.window, self.missed, self.totally_reflected, self.side, self.reflected, self.beside, self.lost]
    }

    fn of_words([window, missed, totally_reflected, side, reflected, beside, lost]: [u128; 7]) -> Self {
        Self { window, missed, totally_reflected, side, reflected, beside, lost }
    }
}
