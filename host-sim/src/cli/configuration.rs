//! Settings from a TOML file and from the options that go before it.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, anyhow};
use garde::Validate;
use impromptu_experiment::demo::DemoSettings;
use impromptu_files::reading;
use impromptu_training::{Purpose, Recipe, derived};
use serde::de::DeserializeOwned;

/// Everything that a run is configured with.
pub(super) struct Configuration {
    /// The demo's settings: file, then options.
    pub(super) settings: DemoSettings,
    /// Whether they are those of a file.
    from_file: bool,
}

impl Configuration {
    /// Reads the file, if one is given; the options win over it.
    pub(super) fn load(file: Option<&Path>, seed: Option<u64>, out: Option<PathBuf>) -> Result<Self> {
        let mut settings: DemoSettings = file.map(checked).transpose()?.unwrap_or_default();
        settings.seed = seed.unwrap_or(settings.seed);
        settings.out = out.or(settings.out);
        Ok(Self { settings, from_file: file.is_some() })
    }

    /// Recipe of the models.
    pub(super) fn recipe(&self) -> &Recipe {
        &self.settings.recipe
    }

    /// Recipe of the models of a study: the file's, or the long one, by whose models studies are compared.
    pub(super) fn study_recipe(&self) -> Recipe {
        if self.from_file { self.settings.recipe.clone() } else { Recipe::long() }
    }

    /// Seed of the run.
    pub(super) fn seed(&self) -> u64 {
        self.settings.seed
    }

    /// Seed of one purpose; none of them shares random numbers with another.
    pub(super) fn seed_of(&self, purpose: Purpose) -> u64 {
        derived(self.settings.seed, purpose)
    }

    /// The folder that files are written to, made if it is not there.
    pub(super) fn folder(&self) -> Result<PathBuf> {
        let folder = self.settings.out.clone().unwrap_or_else(|| "out".into());
        std::fs::create_dir_all(&folder).with_context(|| format!("--out {}: the folder cannot be made", folder.display()))?;
        Ok(folder)
    }
}

/// Reads a TOML file and checks its values; refusals name the key.
pub(super) fn checked<T: DeserializeOwned + Validate<Context = ()>>(path: &Path) -> Result<T> {
    let value: T = toml(path)?;
    // Each value that cannot be, as `recipe.divisor: lower than 1`.
    value.validate().map_err(|report| anyhow!("{}: {}", path.display(), report.to_string().trim_end().replace('\n', "; ")))?;
    Ok(value)
}

/// Reads a TOML file; refusals name file, line and key.
pub(super) fn toml<T: DeserializeOwned>(path: &Path) -> Result<T> {
    let text = reading::read_text(path, reading::SETTINGS).with_context(|| path.display().to_string())?;
    toml::from_str(&text).map_err(|error: toml::de::Error| {
        let before = error.span().and_then(|span| text.get(..span.start)).unwrap_or_default();
        let line = 1 + before.matches('\n').count();
        anyhow!("{}, line {line}: {}", path.display(), error.message())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_option_wins_over_the_file_and_the_file_over_the_default() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("demo.toml");
        std::fs::write(&file, "seed = 5\n[recipe]\nstride = 3\n").unwrap();
        let read = Configuration::load(Some(&file), None, None).unwrap();
        assert_eq!((read.seed(), read.recipe().stride, read.recipe().window), (5, 3, Recipe::default().window));
        assert_eq!(Configuration::load(Some(&file), Some(6), None).unwrap().seed(), 6);
    }

    #[test]
    fn a_value_that_cannot_be_is_refused_with_its_key() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("demo.toml");
        for (text, key) in [
            ("strokes = 0", "strokes"),
            ("strokes = 1000000000000", "strokes"),
            ("extra_delay_ms = 1e12", "extra_delay_ms"),
            ("[recipe.network]\nhidden = [1000000]", "recipe.network"),
            ("speeds = [1.0, -1.0]", "speeds[1]"),
            ("speeds = []", "speeds"),
            ("[recipe]\ndivisor = 0", "recipe.divisor"),
            ("[recipe]\nwindow = [10, -10]", "recipe.window"),
            ("[recipe]\nwindow = [-2000, 4000]", "recipe.window"),
            ("[recipe]\ntraining_flights = []", "recipe.training_flights"),
            ("[recipe.lane]\nfast_limits = [0.1, nan]", "recipe.lane.fast_limits[1]"),
            ("[recipe.lane]\nerror_scale = 0.0", "recipe.lane.error_scale"),
        ] {
            std::fs::write(&file, text).unwrap();
            let message = format!("{:#}", Configuration::load(Some(&file), None, None).err().expect(text));
            assert!(message.contains(&format!("demo.toml: {key}: ")), "{message}");
        }
    }

    #[test]
    fn an_unknown_key_is_refused_with_file_and_line() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("demo.toml");
        std::fs::write(&file, "seed = 5\n[recipe.lane]\neffort = 3\n").unwrap();
        let message = format!("{:#}", Configuration::load(Some(&file), None, None).err().unwrap());
        assert!(message.contains("demo.toml, line 3") && message.contains("`effort`"), "{message}");
    }
}
