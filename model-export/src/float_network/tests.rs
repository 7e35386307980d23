use super::*;
use proptest::prelude::*;

/// 2 inputs, a layer of 3 ReLU, 1 output, and a skip.
fn example() -> FloatNetwork {
    FloatNetwork {
        input_mean: vec![1.0, -1.0],
        input_scale: vec![2.0, 0.5],
        layers: vec![
            DenseLayer {
                weights: vec![1.0, 0.0, 0.0, 1.0, -1.0, -1.0],
                bias: vec![0.0, 0.5, 0.25],
                activation: Activation::Relu,
            },
            DenseLayer { weights: vec![1.0, 2.0, 4.0], bias: vec![-1.0], activation: Activation::Linear },
        ],
        skip: Some(vec![10.0, 100.0]),
        output_mean: vec![7.0],
        output_scale: vec![0.5],
        notes: BTreeMap::from([("log".into(), "flights.csv".into()), ("seed".into(), "3".into())]),
    }
}

#[test]
fn evaluates_the_equations_of_the_module() {
    // n = (1, 2); hidden = (1, 2.5, 0); net = 1 + 5 - 1 = 5; skip = 10 + 200
    assert_eq!(example().evaluate(&[3.0, 0.0]), vec![7.0 + 0.5 * 215.0]);
    let linear = FloatNetwork { layers: vec![], ..example() };
    assert_eq!(linear.evaluate(&[3.0, 0.0]), vec![7.0 + 0.5 * 210.0]);
}

#[test]
fn same_network_same_bytes_and_back() {
    let bytes = example().to_bytes().unwrap();
    for _ in 0..20 {
        assert_eq!(bytes, example().to_bytes().unwrap());
    }
    assert_eq!(FloatNetwork::from_bytes(&bytes).unwrap(), example());
}

#[test]
fn names_what_does_not_fit() {
    let error = |network: FloatNetwork| network.to_bytes().unwrap_err().to_string();
    let mut network = example();
    network.layers[1].weights.pop();
    assert!(error(network).contains("`layer.1.weight` has 2 values; 3 are needed"));
    let mut network = example();
    network.layers[0].bias[1] = f32::NAN;
    assert!(error(network).contains("`layer.0.bias` is not finite at index 1"));
    assert!(error(FloatNetwork { input_scale: vec![1.0, 0.0], ..example() }).contains("`input.scale` must be positive"));
    assert!(error(FloatNetwork { output_mean: vec![], ..example() }).contains("no outputs"));
    let notes = BTreeMap::from([("layer.0.activation".into(), "x".into())]);
    assert!(error(FloatNetwork { notes, ..example() }).contains("`layer.0.activation`"));
}

#[test]
fn names_what_a_foreign_file_lacks() {
    let read = |from: &str, to: &str| {
        assert_eq!(from.len(), to.len(), "the header must keep its length");
        let bytes = example().to_bytes().unwrap();
        let at = bytes.windows(from.len()).position(|window| window == from.as_bytes()).unwrap();
        let mut changed = bytes.clone();
        changed[at..at + to.len()].copy_from_slice(to.as_bytes());
        FloatNetwork::from_bytes(&changed).unwrap_err().to_string()
    };
    assert!(read("\"relu\"", "\"gelu\"").contains("`layer.0.activation` is `gelu`"));
    assert!(read("\"layers\":\"2\"", "\"layers\":\"3\"").contains("`layer.2.weight` is missing"));
    assert!(read("\"layers\":\"2\"", "\"layers\":\"1\"").contains("`layer.1.bias` belongs to no part"));
    assert!(read("layer.1.weight", "layer.1.heavys").contains("`layer.1.weight` is missing"));
    assert!(read("\"version\":\"1\"", "\"version\":\"9\"").contains("`version` is `9`"));
    assert!(read("\"shape\":[3,2]", "\"shape\":[2,3]").contains("`layer.0.bias` has 3 values; 2 are needed"));
}

#[test]
fn a_failed_write_leaves_the_old_file() {
    let folder = std::env::temp_dir().join(format!("float-network-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("network.safetensors");
    example().write(&path).unwrap();
    let mut broken = example();
    broken.output_mean[0] = f32::INFINITY;
    assert!(broken.write(&path).is_err());
    assert_eq!(FloatNetwork::read(&path).unwrap(), example());
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1, "no temporary file stays behind");
    assert!(example().write(&folder.join("absent").join("n")).unwrap_err().to_string().contains("absent"));
    std::fs::remove_dir_all(&folder).unwrap();
}

fn finite() -> impl Strategy<Value = f32> {
    prop_oneof![-1e3f32..1e3, Just(0.0), Just(-0.0), Just(f32::MIN_POSITIVE), Just(f32::MAX)]
}

fn values(count: usize) -> impl Strategy<Value = Vec<f32>> {
    proptest::collection::vec(finite(), count)
}

fn networks() -> impl Strategy<Value = FloatNetwork> {
    let activation = || prop_oneof![Just(Activation::Relu), Just(Activation::Tanh), Just(Activation::Linear)];
    let layer = move |inputs: usize, outputs: usize| {
        (values(inputs * outputs), values(outputs), activation()).prop_map(|(weights, bias, activation)| DenseLayer {
            weights,
            bias,
            activation,
        })
    };
    (1usize..5, 1usize..5, 1usize..4, any::<bool>(), any::<bool>()).prop_flat_map(move |(inputs, hidden, outputs, deep, skip)| {
        let layers = if deep { vec![layer(inputs, hidden), layer(hidden, outputs)] } else { vec![] };
        let with_skip = skip || !deep;
        let scales = |count| proptest::collection::vec(1e-6f32..1e6, count);
        (values(inputs), scales(inputs), layers, values(inputs * outputs), values(outputs), scales(outputs), ".*").prop_map(
            move |(input_mean, input_scale, layers, skip, output_mean, output_scale, note)| FloatNetwork {
                input_mean,
                input_scale,
                layers,
                skip: with_skip.then_some(skip),
                output_mean,
                output_scale,
                notes: BTreeMap::from([("note".into(), note)]),
            },
        )
    })
}

proptest! {
    #[test]
    fn write_then_read_is_identity(network in networks()) {
        prop_assert_eq!(FloatNetwork::from_bytes(&network.to_bytes().unwrap()).unwrap(), network);
    }

    #[test]
    fn damaged_files_never_panic(
        network in networks(),
        cut in any::<prop::sample::Index>(),
        flip in any::<prop::sample::Index>(),
    ) {
        let bytes = network.to_bytes().unwrap();
        prop_assert!(FloatNetwork::from_bytes(&bytes[..cut.index(bytes.len())]).is_err());
        let mut flipped = bytes.clone();
        let bit = flip.index(bytes.len() * 8);
        flipped[bit / 8] ^= 1 << (bit % 8);
        if let Ok(read) = FloatNetwork::from_bytes(&flipped) {
            prop_assert!(read.check().is_ok());
        }
    }
}
