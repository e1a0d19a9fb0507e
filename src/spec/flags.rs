//! Settings as the flags that ask for them.

use super::settings::Settings;
use serde_json::Value;

impl Settings {
    /// The flags of `glasswarp design` that ask for the same, in the order of their declaration;
    /// the picture is no flag.
    ///
    /// ```
    /// use glasswarp::spec::{Length, Settings};
    ///
    /// let settings = Settings { size: Some(Length { mm: 80.0 }), mirror: Some(true), ..Settings::default() };
    /// assert_eq!(settings.flags(), ["--size=80mm", "--mirror"]);
    /// ```
    pub fn flags(&self) -> Vec<String> {
        let Ok(Value::Object(written)) = serde_json::to_value(self) else { return Vec::new() };
        let of = |name: &&str| {
            let name = name.replace('_', "-");
            let flag = match written.get(&name)? {
                Value::Null => return None,
                Value::Bool(true) => format!("--{name}"),
                Value::String(text) => format!("--{name}={text}"),
                // A whole number is written without its fraction.
                Value::Number(number) => {
                    format!("--{name}={}", number.as_f64().map_or_else(|| number.to_string(), |x| x.to_string()))
                }
                other => format!("--{name}={other}"),
            };
            Some(flag)
        };
        Self::NAMES.iter().filter(|&&name| name != "picture").filter_map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::DesignFile;
    use clap::{Args, FromArgMatches};

    #[test]
    fn flags_ask_for_what_the_settings_say() {
        let text = "[design]\nsize = \"120mm\"\ndistance = 200\nwindow = \"25cm\"\nshift = \"25mm,-10mm\"\nreceiver-tilt = \"20deg,90deg\"\n\
            mirror = false\ntilt = \"20deg\"\nlight = \"point\"\nsource-distance = \"1m\"\nemission = \"gaussian:12deg\"\nwavelength = \"532nm\"\n\
            material = \"bk7\"\nthickness = \"11.5mm\"\nsource-size = \"5x3mm\"\nroughness = \"0.1deg\"\ndeconvolution = \"paper\"\n\
            deconvolution-rounds = 8\noutline = \"rounded:10mm\"\nnodes = 257\nrim = \"8mm,-8.5mm\"\nmark = \"3mm\"\norigin = \"stock-top\"\n\
            step-tolerance = \"0.05um\"\noffset = 0.15\nmargin = 0.1\nvignette = \"circle:0.2\"\ntransfer = \"linear\"\nbackground = \"#ff8000\"\n\
            crop = \"10%,0%,80%,100%\"\nrotate = \"90deg\"\nflip = \"horizontal\"\nlevels = \"0.1,0.9,1.2\"\ninvert = true\nsolver = \"transport\"\n\
            quality = \"fine\"\nmin-radius = \"1mm\"\nfinish = \"polish=0.1mm,cutter=ball:d6mm,step-over=0.1mm\"";
        let settings = toml::from_str::<DesignFile>(text).unwrap().design;
        let command = Settings::augment_args(clap::Command::new("design").no_binary_name(true));
        let read = Settings::from_arg_matches(&command.get_matches_from(settings.flags())).unwrap();
        assert_eq!(serde_json::to_value(&read).unwrap(), serde_json::to_value(&settings).unwrap());
    }
}
