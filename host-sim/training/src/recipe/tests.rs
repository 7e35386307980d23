use super::*;

/// The demo's settings are in the file: [recipe] is a part of them.
#[test]
fn the_file_of_the_long_recipe_is_the_long_recipe() {
    #[derive(Deserialize)]
    struct Settings {
        recipe: Recipe,
    }
    let file: Settings = toml::from_str(include_str!("../../recipes/long.toml")).unwrap();
    assert_eq!(file.recipe, Recipe::long());
}

#[test]
fn what_no_training_can_use_is_refused_with_value_and_range() {
    Recipe::default().validate().unwrap();
    Recipe::long().validate().unwrap();
    for (text, refusal) in [
        ("window_step = 0", "window_step: 0 is not from 1 to 1000"),
        ("fade_s = 1e12", "fade_s: 1000000000000 is not from 0 to 60"),
        ("smoothing_s = nan", "smoothing_s: NaN is not from 0 to 2"),
        ("validation_speeds = [0.0]", "validation_speeds[0]: 0 is not from 0.05 to 20"),
        ("[network]\nhidden = [1000000]", "network: training setting `hidden` is [1000000]"),
        ("[network]\nepochs = 1000000000000", "network: training setting `epochs` is 1000000000000"),
        ("[lane.design]\nlags = 1000000", "lane.design: `lags` is 1000000"),
        ("[lane]\ndither = 1e308", "lane.dither: "),
    ] {
        let recipe: Recipe = toml::from_str(text).unwrap();
        let message = recipe.validate().expect_err(text).to_string();
        assert!(message.contains(refusal), "{text}: {message}");
    }
    for (change, refusal) in [
        ("shortest_s = 0.0", "shortest_s: 0 is not from 0.05 to 10"),
        ("seconds = 0.0", "seconds: 0 is not from 6 to 3590"),
        ("seconds = 1e12", "seconds: 1000000000000 is not from 6 to 3590"),
        ("flights = 4000000000", "flights: 4000000000 is not from 1 to 3000"),
        ("flights = 3000", "seconds: 3000 flights of 90 s are 270000 s"),
        ("max_speed = 0.0", "max_speed: 0 is not from 0.01 to 50"),
    ] {
        let usual = [
            "signal = \"multisine\"",
            "flights = 2",
            "seconds = 90.0",
            "max_speed = 1.5",
            "max_acceleration = 5.0",
            "shortest_s = 0.5",
        ];
        let key = change.split(' ').next().unwrap();
        let lines: Vec<&str> =
            usual.iter().map(|line| if line.starts_with(&format!("{key} ")) { change } else { line }).collect();
        let recipe: Recipe = toml::from_str(&format!("[[training_flights]]\n{}", lines.join("\n"))).unwrap();
        let message = recipe.validate().expect_err(change).to_string();
        assert!(message.contains(&format!("training_flights[0].{refusal}")), "{change}: {message}");
    }
}
