//! Model files that are flown.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use impromptu_files::reading;
use impromptu_firmware::{
    adapter::Lanes,
    features::{Relative, Source},
    model::{Arithmetic, Model},
};
use impromptu_report::Method;

use super::situation::Situation;

/// The bytes of a model file.
pub(super) struct ModelFile {
    path: PathBuf,
    bytes: Vec<u8>,
}

impl ModelFile {
    pub(super) fn read(path: &Path) -> Result<Self> {
        let bytes = reading::read(path, reading::DOCUMENT).with_context(|| path.display().to_string())?;
        Ok(Self { path: path.to_owned(), bytes })
    }

    /// The file as it was named.
    pub(super) fn name(&self) -> String {
        self.path.display().to_string()
    }

    /// The file's bytes.
    pub(super) fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The model, checked as a firmware with these limits checks it.
    pub(super) fn model<const C: usize, const O: usize, const A: usize>(&self) -> Result<Model<'_, C, O, A>> {
        Model::sized(&self.bytes).with_context(|| format!("{}: refused", self.name()))
    }

    /// What the model was made for, if it is flown with something else.
    pub(super) fn mismatch(&self, model: &Model<'_>, situation: &Situation) -> Option<String> {
        let made = &model.card().provenance;
        let made = [made.vehicle, made.gains, made.condition];
        let flown = [&situation.vehicle, situation.gains_name(), &situation.condition];
        let differs = made != flown;
        differs.then(|| format!("{}: made for {}, flown with {}", self.name(), made.join(" "), flown.join(" ")))
    }
}

/// The method as which flights with these lanes are reported.
pub(super) fn method(model: &Model<'_>, lanes: Lanes) -> Method {
    let card = model.card();
    // Accelerations alone, as they are desired now: the flatness feed-forward.
    let accelerations = card.features.iter().all(|feature| {
        let present = feature.offset == 0 && feature.relative == Relative::Nothing;
        present && feature.source == Source::Desired && (6..9).contains(&feature.channel)
    });
    let [alone, with_feedback] = match &card.network {
        Some(network) if network.layers.is_empty() && accelerations => [Method::Feedforward, Method::FeedforwardFeedback],
        Some(network) if network.layers.is_empty() => [Method::Ridge, Method::FullRidge],
        Some(network) if network.arithmetic == Arithmetic::Float => [Method::NetF32, Method::FullF32],
        Some(_) => [Method::NetInt8, Method::FullInt8],
        None => [Method::Baseline, Method::Feedback],
    };
    match (lanes.network, lanes.feedback && model.feedback().is_some()) {
        (true, true) => with_feedback,
        (true, false) => alone,
        (false, true) => Method::Feedback,
        (false, false) => Method::Baseline,
    }
}
