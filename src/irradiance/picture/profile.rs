//! ICC profiles: the luminance of numbers in a picture. `moxcms` takes the file apart; its
//! transforms end in another device's colours, while what is wanted here is the light itself.

use super::{
    curve::{Curve, Model},
    lightness::{Lightness, Mixing, Space, Table},
    primaries::{D50, from_d50},
};
use glam::{DMat3, DVec3};
use moxcms::{
    ColorProfile, DataColorSpace, LutDataType, LutMultidimensionalType, LutStore, LutType, LutWarehouse, Matrix3d,
    ProfileText, ToneReprCurve,
};
use std::sync::Arc;

/// A picture's profile: its name, and what it says of light.
///
/// # Errors
/// In words, why it cannot be used.
pub(super) fn read(bytes: &[u8], model: Model) -> Result<(Lightness, String), String> {
    let profile = ColorProfile::new_from_slice(bytes).map_err(|_| "its ICC profile is broken".to_owned())?;
    let name = name_of(&profile);
    let odd = |what: &str| format!("its ICC profile '{name}' {what}");
    let lightness = match (profile.color_space, model) {
        (DataColorSpace::Gray, Model::Grey) => {
            let curve = profile.gray_trc.as_ref().ok_or_else(|| odd("has no curve for grey"))?;
            Lightness::Grey(curve_of(curve).ok_or_else(|| odd("has a broken curve"))?)
        }
        (DataColorSpace::Rgb, Model::Rgb | Model::Grey) | (DataColorSpace::Cmyk, Model::Cmyk) => {
            let table = profile.lut_a_to_b_colorimetric.as_ref().or(profile.lut_a_to_b_perceptual.as_ref());
            match table {
                Some(table) => {
                    let channels = if profile.color_space == DataColorSpace::Cmyk { 4 } else { 3 };
                    let table = Table::of(table, profile.pcs, channels);
                    Lightness::Table(Arc::new(table.ok_or_else(|| odd("has a table that is broken or unusual"))?))
                }
                None => matrix(&profile).ok_or_else(|| odd("has neither table nor matrix"))?,
            }
        }
        (of, _) => return Err(odd(&format!("is one for {of:?} and not for the colours of the picture"))),
    };
    Ok((lightness, name))
}

fn name_of(profile: &ColorProfile) -> String {
    let name = match &profile.description {
        Some(ProfileText::PlainString(text)) => text.clone(),
        Some(ProfileText::Localizable(texts)) => texts.first().map(|text| text.value.clone()).unwrap_or_default(),
        Some(ProfileText::Description(text)) => text.ascii_string.clone(),
        None => String::new(),
    };
    // It is shown on a terminal.
    let name: String = name.chars().filter(|c| !c.is_control()).take(60).collect();
    if name.trim().is_empty() { "without a name".into() } else { name.trim().into() }
}

fn curve_of(curve: &ToneReprCurve) -> Option<Curve> {
    Some(match curve {
        ToneReprCurve::Lut(values) => match values[..] {
            [] => Curve::Power(1.0),
            [gamma] => Curve::Power(f64::from(gamma) / 256.0),
            _ => Curve::Sampled(values.iter().map(|v| f64::from(*v) / 65535.0).collect()),
        },
        // The forms of ICC.1:2022, 10.18, as the last of them.
        ToneReprCurve::Parametric(numbers) => {
            let numbers: Vec<f64> = numbers.iter().map(|v| f64::from(*v)).collect();
            Curve::Parametric(match numbers[..] {
                [g] => [g, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
                [g, a, b] => [g, a, b, 0.0, -b / a, 0.0, 0.0],
                [g, a, b, c] => [g, a, b, 0.0, -b / a, c, c],
                [g, a, b, c, d] => [g, a, b, c, d, 0.0, 0.0],
                [g, a, b, c, d, e, f] => [g, a, b, c, d, e, f],
                _ => return None,
            })
        }
    })
}

/// Three curves, and how bright the three colours are in the profile's own white.
fn matrix(profile: &ColorProfile) -> Option<Lightness> {
    let curves = [&profile.red_trc, &profile.green_trc, &profile.blue_trc];
    let curves = curves.map(|curve| curve.as_ref().and_then(curve_of));
    let [Some(r), Some(g), Some(b)] = curves else { return None };
    let vector = |of: &moxcms::Xyzd| DVec3::new(of.x, of.y, of.z);
    let back = match (&profile.chromatic_adaptation, &profile.media_white_point) {
        (Some(adaptation), _) => {
            let adaptation = matrix_of(adaptation);
            (adaptation.determinant().abs() > 1e-6).then(|| adaptation.inverse())
        }
        (None, Some(white)) if (vector(white) - D50).abs().max_element() > 1e-3 => from_d50(vector(white)),
        _ => None,
    };
    let back = back.unwrap_or(DMat3::IDENTITY);
    let weights = [&profile.red_colorant, &profile.green_colorant, &profile.blue_colorant];
    let weights = weights.map(|colour| (back * vector(colour)).y);
    let white: f64 = weights.iter().sum();
    (white.is_finite() && white > 1e-6)
        .then(|| Lightness::Rgb { curves: [r, g, b], weights: weights.map(|weight| weight / white) })
}

fn matrix_of(matrix: &Matrix3d) -> DMat3 {
    let row = |k: usize| DVec3::from(matrix.v[k]);
    DMat3::from_cols(row(0), row(1), row(2)).transpose()
}

impl Table {
    fn of(table: &LutWarehouse, pcs: DataColorSpace, channels: usize) -> Option<Self> {
        let legacy = matches!(table, LutWarehouse::Lut(LutDataType { lut_type: LutType::Lut16, .. }));
        let space = match pcs {
            DataColorSpace::Xyz => Space::Xyz,
            DataColorSpace::Lab => Space::Lab { white: if legacy { 65280.0 / 65535.0 } else { 1.0 } },
            _ => return None,
        };
        let table = match table {
            LutWarehouse::Lut(lut) => Self::of_lut(lut, space),
            LutWarehouse::Multidimensional(lut) => Self::of_curves(lut, space),
        }?;
        let whole = table.grid.iter().try_fold(1usize, |product, n| product.checked_mul(*n))?;
        let fits = table.before.len() == channels && table.grid.len() == channels;
        (fits && table.grid.iter().all(|n| *n > 0) && table.colours.len() == whole).then_some(table)
    }

    fn of_lut(lut: &LutDataType, space: Space) -> Option<Self> {
        let (inputs, outputs) = (usize::from(lut.num_input_channels), usize::from(lut.num_output_channels));
        if outputs != 3 {
            return None;
        }
        let sampled = |store: &LutStore, entries: u16, channels: usize| -> Option<Vec<Curve>> {
            let (values, entries) = (shares(store), usize::from(entries));
            (entries > 1 && values.len() == entries * channels)
                .then(|| values.chunks_exact(entries).map(|part| Curve::Sampled(part.into())).collect())
        };
        Some(Self {
            before: sampled(&lut.input_table, lut.num_input_table_entries, inputs)?,
            grid: vec![usize::from(lut.num_clut_grid_points); inputs],
            colours: triples(&lut.clut_table),
            mixing: None,
            last: three(sampled(&lut.output_table, lut.num_output_table_entries, 3)?)?,
            space,
        })
    }

    fn of_curves(lut: &LutMultidimensionalType, space: Space) -> Option<Self> {
        let inputs = usize::from(lut.num_input_channels);
        let curves = |of: &[ToneReprCurve]| of.iter().map(curve_of).collect::<Option<Vec<_>>>();
        let (store, last) = (lut.clut.as_ref()?, three(curves(&lut.b_curves)?)?);
        let mixing = if lut.m_curves.is_empty() {
            None
        } else {
            let offset = DVec3::from(lut.bias.v);
            Some(Mixing { curves: three(curves(&lut.m_curves)?)?, matrix: matrix_of(&lut.matrix), offset })
        };
        let before = curves(&lut.a_curves)?;
        let grid = lut.grid_points.iter().take(inputs).map(|n| usize::from(*n)).collect();
        (usize::from(lut.num_output_channels) == 3).then(|| Self {
            before,
            grid,
            colours: triples(store),
            mixing,
            last,
            space,
        })
    }
}

fn three<T>(values: Vec<T>) -> Option<[T; 3]> {
    values.try_into().ok()
}

/// Numbers of a table on a scale from 0 to 1.
fn shares(store: &LutStore) -> Vec<f64> {
    match store {
        LutStore::Store8(values) => values.iter().map(|v| f64::from(*v) / 255.0).collect(),
        LutStore::Store16(values) => values.iter().map(|v| f64::from(*v) / 65535.0).collect(),
    }
}

fn triples(store: &LutStore) -> Vec<[f32; 3]> {
    match store {
        LutStore::Store8(values) => values.as_chunks::<3>().0.iter().map(|c| c.map(|v| f32::from(v) / 255.0)).collect(),
        LutStore::Store16(values) => {
            values.as_chunks::<3>().0.iter().map(|c| c.map(|v| f32::from(v) / 65535.0)).collect()
        }
    }
}
