//! What the air does to the flights: a constant wind, gusts, and unmodelled forces, seeded member by member.
//!
//! *in*: settings, tick length, a seed for each member; *out*: the [`Disturbance`] of each tick; *never*: a member that depends
//! on another member, or a source that changes because a second one is switched on; *source*: Uhlenbeck and Ornstein
//! (Phys. Rev. 36, 1930); Dryden gusts of MIL-F-8785C, low altitude.

mod dryden;
mod error;
mod ornstein_uhlenbeck;

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use crate::plant::{BATCH, Disturbance};

pub use dryden::Dryden;
pub use error::WeatherError;
pub use ornstein_uhlenbeck::OrnsteinUhlenbeck;

use dryden::Gusts;
use error::require;
use ornstein_uhlenbeck::Process;

/// What disturbs a flight; nothing by default.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WeatherSettings {
    /// Random acceleration, m/s², world ENU.
    pub acceleration: OrnsteinUhlenbeck,
    /// Constant wind, m/s, world ENU.
    pub mean_wind: [f64; 3],
    /// Random wind on top of the constant one, m/s, world ENU.
    pub wind: OrnsteinUhlenbeck,
    /// Dryden gusts on top of both, if any.
    pub gusts: Option<Dryden>,
}

/// The random sources of one member.
#[derive(Debug, Clone)]
struct Sources {
    acceleration: Process,
    wind: Process,
    gusts: Option<Gusts>,
}

/// The weather of [`BATCH`] flights.
#[derive(Debug, Clone)]
pub struct Weather {
    mean_wind: [f64; 3],
    members: [Sources; BATCH],
    changes: bool,
    disturbance: Disturbance,
}

impl Weather {
    /// The weather that the flights with these `seeds` meet, in steps of `tick` seconds. It starts as if it had always
    /// been going on. The seeds may be those of other parts of the same flights: the weather salts its own.
    ///
    /// # Errors
    /// A setting that is not finite or out of its range.
    pub fn new(settings: &WeatherSettings, tick: f64, seeds: [u64; BATCH]) -> Result<Self, WeatherError> {
        require(tick.is_finite() && tick > 0.0, "tick", "positive (s)")?;
        let finite = settings.mean_wind.iter().all(|value| value.is_finite());
        require(finite, "mean_wind", "finite (m/s)")?;
        settings.acceleration.check("acceleration")?;
        settings.wind.check("wind")?;
        if let Some(gusts) = &settings.gusts {
            gusts.check()?;
        }
        // A stream of its own for each source, so that switching one on leaves the others' bits alone.
        let stream = |seed: u64, salt: u64| Xoshiro256PlusPlus::seed_from_u64(seed ^ salt);
        let members = seeds.map(|seed| Sources {
            acceleration: Process::new(&settings.acceleration, tick, stream(seed, 0x61c8_8646_80b5_83eb)),
            wind: Process::new(&settings.wind, tick, stream(seed, 0x3c6e_f372_fe94_f82b)),
            gusts: settings.gusts.as_ref().map(|gusts| {
                let stream = stream(seed, 0xa54f_f53a_5f1d_36f1);
                Gusts::new(gusts, settings.mean_wind, tick, stream)
            }),
        });
        let mut weather = Self {
            mean_wind: settings.mean_wind,
            changes: !settings.acceleration.is_still() || !settings.wind.is_still() || settings.gusts.is_some(),
            members,
            disturbance: Disturbance::default(),
        };
        weather.publish();
        Ok(weather)
    }

    /// What acts during the present tick.
    pub fn now(&self) -> &Disturbance {
        &self.disturbance
    }

    /// Goes on to the next tick and returns what acts during it.
    pub fn advance(&mut self) -> &Disturbance {
        if self.changes {
            for sources in &mut self.members {
                sources.acceleration.advance();
                sources.wind.advance();
                if let Some(gusts) = &mut sources.gusts {
                    gusts.advance();
                }
            }
            self.publish();
        }
        &self.disturbance
    }

    fn publish(&mut self) {
        for (member, sources) in self.members.iter().enumerate() {
            let random = sources.wind.value();
            let gust = sources.gusts.as_ref().map_or([0.0; 3], Gusts::value);
            let wind = std::array::from_fn(|axis| self.mean_wind[axis] + random[axis] + gust[axis]);
            self.disturbance.set_member(member, wind, sources.acceleration.value());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SEEDS: [u64; BATCH] = [1, 2, 3, 4, 5, 6, 7, 8];

    fn stormy() -> WeatherSettings {
        WeatherSettings {
            acceleration: OrnsteinUhlenbeck { sigma: [0.12; 3], correlation_time: 0.4 },
            mean_wind: [1.0, -2.0, 0.0],
            wind: OrnsteinUhlenbeck { sigma: [0.5, 0.5, 0.2], correlation_time: 2.0 },
            gusts: Some(Dryden { wind_at_6_m: 4.0, altitude: 5.0, airspeed: 3.0 }),
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_bits_in_any_member() {
        let mut first = Weather::new(&stormy(), 0.01, SEEDS).unwrap();
        let mut seeds = SEEDS;
        seeds.reverse();
        let mut second = Weather::new(&stormy(), 0.01, seeds).unwrap();
        for _ in 0..1000 {
            let (a, b) = (first.advance(), second.advance());
            for axis in 0..3 {
                let mut reversed = b.wind_velocity[axis];
                reversed.reverse();
                assert_eq!(a.wind_velocity[axis], reversed);
                assert_ne!(a.wind_velocity[axis][0], a.wind_velocity[axis][1]);
            }
        }
    }

    #[test]
    fn switching_a_source_on_leaves_the_others_bits_alone() {
        let calm_air = WeatherSettings { acceleration: stormy().acceleration, ..WeatherSettings::default() };
        let mut alone = Weather::new(&calm_air, 0.01, SEEDS).unwrap();
        let mut together = Weather::new(&stormy(), 0.01, SEEDS).unwrap();
        for _ in 0..100 {
            let alone = alone.advance();
            assert_eq!(alone.acceleration, together.advance().acceleration);
            assert_eq!(alone.wind_velocity, [[0.0; BATCH]; 3]);
        }
    }

    #[test]
    fn settings_without_meaning_are_refused_by_name() {
        let with = |change: fn(&mut WeatherSettings)| {
            let mut settings = stormy();
            change(&mut settings);
            Weather::new(&settings, 0.01, SEEDS).unwrap_err().field
        };
        assert_eq!(with(|s| s.acceleration.sigma[1] = -1.0), "acceleration");
        assert_eq!(with(|s| s.wind.correlation_time = 0.0), "wind");
        assert_eq!(with(|s| s.mean_wind[2] = f64::NAN), "mean_wind");
        assert_eq!(with(|s| s.gusts.as_mut().unwrap().altitude = 500.0), "gusts.altitude");
        assert!(Weather::new(&stormy(), 0.0, SEEDS).is_err());
        assert!(toml::from_str::<WeatherSettings>("mean_wnd = [0.0, 0.0, 0.0]").is_err());
    }
}
