//! The diagnosis in words, for a reader who doubts it: every figure with its interval and with what it was judged by.

use crate::{
    Diagnosis,
    add_on::Features,
    digits::digits,
    properties::{Interval, RelativeDegree, THRESHOLD},
    verdict::{FAR, Gate, LEAST_REDUCTION, Verdict, is_beyond, judged_zeros},
};

/// Errors that differ by more than this factor are said to differ.
const ALIKE: f64 = 1.5;
/// Width of the text, characters.
const WIDTH: usize = 130;

impl Diagnosis {
    /// The verdict and why, in one sentence or two.
    pub fn verdict_text(&self) -> String {
        let prediction = &self.prediction;
        let reduction = percent(prediction.reduction_percent);
        let mut text = self.verdict.words().to_owned();
        match self.verdict {
            Verdict::WillHelp => {
                text += &format!(": stable inverse, gain of one; predicted reduction of the RMS error {reduction}")
            }
            Verdict::WillHelpWithoutDifferenceLearning => {
                let why = self.gates.unit_gain.why().unwrap_or_default();
                text += &format!(": {why}; predicted reduction of the RMS error {reduction}");
            }
            Verdict::WillHelpByWindow => {
                let why = self.gates.stable_inverse.why().unwrap_or_default();
                text += &format!(
                    ": {why}. A window over the desired output stays bounded all the same; predicted reduction of the RMS error \
                     {reduction}"
                );
            }
            Verdict::WillNot => {
                text += &format!(
                    ": there is little to gain; predicted reduction {reduction}, noise alone leaves {:.3e} of {:.3e} RMS",
                    prediction.floor, prediction.baseline.value
                );
            }
            Verdict::CannotTell => {
                text += &format!(": the log leaves a reduction of {reduction} possible; {}", self.next());
            }
        }
        text
    }

    /// What to log next, where this one does not decide: longer by the square of what its interval is too wide by, or larger by
    /// as much, since the noise stays as it is.
    fn next(&self) -> String {
        let Interval { low, value, high } = self.prediction.undisturbed_percent;
        let wide = if value >= LEAST_REDUCTION { value - low } else { high - value };
        let factor = (wide / (value - LEAST_REDUCTION).abs().max(0.1)).clamp(1.2, 10.0);
        let what = match &self.gates.excitation {
            Gate::Passed => String::new(),
            Gate::Undecided(why) | Gate::Failed(why) => format!("; {why}"),
        };
        format!("log {} times as long, or with {} times the amplitude{what}", digits(factor * factor), digits(factor))
    }

    /// The lines as text for a terminal, broken at 130 characters.
    pub fn text(&self, unit: &str) -> String {
        let lines = self.lines(unit);
        let label = lines.iter().map(|[label, _]| label.chars().count()).max().unwrap_or(0) + 2;
        let mut text = String::new();
        for [name, words] in lines {
            let mut column = label;
            text += &format!("{name:label$}");
            for word in words.split(' ') {
                if column + word.chars().count() > WIDTH && column > label {
                    text += &format!("\n{:label$}", "");
                    column = label;
                }
                text += word;
                text.push(' ');
                column += word.chars().count() + 1;
            }
            text.truncate(text.trim_end().len());
            text.push('\n');
        }
        text
    }

    /// Lines of label and text; `unit` is that of the measured value.
    pub fn lines(&self, unit: &str) -> Vec<[String; 2]> {
        let (properties, prediction) = (&self.properties, &self.prediction);
        let tick = 1e3 / self.sub_rate_hz;
        let line = |label: &str, text: String| [label.to_owned(), text];
        let mut lines = vec![line("verdict", self.verdict_text())];
        for gate in [&self.gates.unit_gain, &self.gates.stable_inverse, &self.gates.excitation] {
            // What the verdict says already is not said again.
            if let Gate::Undecided(why) = gate
                && !lines[0][1].contains(why.as_str())
            {
                lines.push(line("undecided", why.clone()));
            }
        }
        let features = match prediction.features {
            Features::Relative => "relative to now (difference learning)",
            Features::Absolute => "absolute",
        };
        lines.push(line(
            "recommended",
            format!(
                "sub-rate {} Hz, preview {} s, desired output from {} s ago to there, {features}",
                digits(self.recommended_sub_rate_hz),
                digits(self.recommended_preview_s),
                digits(prediction.window.past as f64 / self.sub_rate_hz)
            ),
        ));
        lines.push(line("error without", self.errors_without(unit)));
        lines.push(line(
            "error with",
            format!(
                "{} ({} … {}) {unit} RMS predicted with the add-on; noise alone {}; on signals of the log's kind",
                digits(prediction.with_add_on.value),
                digits(prediction.with_add_on.low),
                digits(prediction.with_add_on.high),
                digits(prediction.floor)
            ),
        ));
        if let Some(other) = &self.with_difference_learning {
            lines.push(line("with difference learning", format!("predicted reduction {}", percent(other.reduction_percent))));
        }
        lines.push(line(
            "relative degree",
            format!(
                "{} strict (first coefficient that the data tell from zero); {} practical (first tick above {:.0} % of the \
                 step); ticks of {} ms",
                degree(properties.strict_degree),
                degree(properties.practical_degree),
                100.0 * THRESHOLD,
                digits(tick)
            ),
        ));
        lines.push(line(
            "steady-state gain",
            format!("{}, from {} Hz and above", interval(properties.gain, 3), digits(self.coverage.lowest_hz)),
        ));
        lines.push(line("output at zero", format!("{} {unit}", interval(properties.offset, 4))));
        lines.push(line("initial reversal", self.reversal_text()));
        let inside = |re: f64, im: f64| judged_zeros(properties, &self.coverage).any(|zero| (zero.re, zero.im) == (re, im));
        let zeros = properties.zeros.iter().map(|zero| {
            let seen = if inside(zero.re, zero.im) {
                ""
            } else {
                match zero.magnitude.value {
                    FAR.. => ", so far out that it is one more tick of dead time",
                    _ => ", faster than what the log excites: not judged",
                }
            };
            format!("{}{seen}", zero.words())
        });
        let zeros: Vec<String> = zeros.collect();
        lines.push(line("zeros", if zeros.is_empty() { "none".into() } else { zeros.join("; ") }));
        let poles = self.model.poles().iter().map(|pole| format!("{:.3}", pole.norm())).collect::<Vec<_>>().join(", ");
        lines.push(line("poles", format!("|z| {poles}")));
        lines.push(line(
            "lag of slow signals",
            format!(
                "{} s; of motions of {} Hz, as the log's are, {} s; settles in {} s",
                of_digits(properties.lag_s),
                digits(properties.motion_hz),
                of_digits(properties.motion_lag_s),
                digits(properties.settling_s)
            ),
        ));
        lines.push(line("bandwidth (-3 dB)", self.bandwidth_text()));
        lines.push(line(
            "noise floor",
            format!(
                "{:.3e} {unit} RMS; the model explains {:.2} % of the measured variance",
                properties.noise,
                100.0 * properties.explained
            ),
        ));
        lines.push(line(
            "excitation",
            format!(
                "{:.0} % of the band up to the bandwidth is above the noise, the highest at {} Hz",
                100.0 * self.coverage.share,
                digits(self.coverage.highest_hz)
            ),
        ));
        lines.push(line(
            "identified from",
            format!(
                "{} samples at {} Hz (log: {} Hz); intervals hold 95 % of the linear models that could be true; seed {}",
                self.samples,
                digits(self.sub_rate_hz),
                digits(self.rate_hz),
                self.seed
            ),
        ));
        lines
    }

    /// The error without the add-on, as logged and as predicted: two figures that should be near each other.
    fn errors_without(&self, unit: &str) -> String {
        let (logged, predicted) = (self.logged_error, self.prediction.baseline.value);
        let ratio = predicted / logged;
        let far = if (1.0 / ALIKE..=ALIKE).contains(&ratio) {
            String::new()
        } else {
            format!(
                ": {} times as much, since the model flies half of the log backwards at another speed; trust the share, not \
                 the size",
                digits(ratio)
            )
        };
        format!("{} {unit} RMS as logged; {} as the model predicts it{far}", digits(logged), digits(predicted))
    }

    /// A model that never falls by 3 dB has no bandwidth below half of its rate.
    fn bandwidth_text(&self) -> String {
        let bandwidth = self.properties.bandwidth_hz;
        let most = 0.5 * self.sub_rate_hz;
        if is_beyond(bandwidth.value, most) {
            return format!("above {} Hz, the highest that this sub-rate shows", digits(most));
        }
        let high =
            if is_beyond(bandwidth.high, most) { "and above".to_owned() } else { format!("… {}", digits(bandwidth.high)) };
        format!("{} ({} {high}) Hz", digits(bandwidth.value), digits(bandwidth.low))
    }

    fn reversal_text(&self) -> String {
        let reversal = self.properties.reversal;
        if reversal.value == 0.0 {
            return "none".into();
        }
        format!(
            "{:.1} % of the step ({:.1} … {:.1} %), final sign after {} ticks",
            100.0 * reversal.value,
            100.0 * reversal.low,
            100.0 * reversal.high,
            self.properties.reversal_ticks
        )
    }
}

fn degree(degree: RelativeDegree) -> String {
    if degree.low == degree.high {
        degree.value.to_string()
    } else {
        format!("{} ({} … {})", degree.value, degree.low, degree.high)
    }
}

fn of_digits(interval: Interval) -> String {
    format!("{} ({} … {})", digits(interval.value), digits(interval.low), digits(interval.high))
}

fn interval(interval: Interval, decimals: usize) -> String {
    format!("{:.decimals$} ({:.decimals$} … {:.decimals$})", interval.value, interval.low, interval.high)
}

fn percent(interval: Interval) -> String {
    format!("{:.1} % ({:.1} … {:.1} %)", interval.value, interval.low, interval.high)
}
