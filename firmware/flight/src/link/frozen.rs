//! The protocol's bytes, which must not change within a version.
//!
//! *in* one value of every message; *out* its payload's bytes; *never* other bytes within a version; *source* the bytes of the
//! first build of the version.

use super::{
    Command, FRAME, Outcome, Reason, Report, VERSION, encode,
    message::{
        FlyingModel, FrameReport, Identity, Inertial, InputReport, LaneReport, LearnOrder, LearnedPiece, LearningReport,
        ModelChunk, Motors, Position, TRIP_REASONS, Telemetry, TimedSetpoint,
    },
    outcome::{ModelFault, Quantity},
};
use impromptu_firmware::{
    adapter::Lanes,
    learning::{Phase, Problem, Unfit},
};

use crate::{
    control::{Airframe, AttitudeGains, PositionGains},
    settings::{Rates, Setting, Settings},
};

/// Numbers that no two fields share.
fn numbers<const N: usize>(first: f32) -> [f32; N] {
    core::array::from_fn(|i| first + 0.25 * i as f32)
}

/// One of each command.
pub(super) fn commands() -> [Command<'static>; 20] {
    let airframe = Airframe {
        mass: 0.5,
        inertia: numbers(1.0),
        rotors: [numbers(2.0), numbers(2.5), numbers(-3.0), numbers(-3.5)],
        directions: numbers(4.0),
        thrust_coefficient: 5.0,
        torque_coefficient: 5.25,
        max_rotor_speed: 2500.0,
    };
    let position = PositionGains { kp: numbers(6.0), kd: numbers(7.0), ki: numbers(8.0), integral_limit: 9.0 };
    let attitude = AttitudeGains { kp: 10.0, kd: 11.0 };
    let rates = Rates { control_hz: 500.0, position_divisor: 5 };
    [
        Command::Hello,
        Command::Inertial(Inertial { tick: 300, attitude: [0.5, -0.5, 0.5, -0.5], rates: numbers(1.0) }),
        Command::Position(Position { tick: 301, position: numbers(-1.0), velocity: numbers(2.0), vertical_acceleration: 3.0 }),
        Command::Setpoint(TimedSetpoint {
            tick: -302,
            position: numbers(1.0),
            velocity: numbers(2.0),
            acceleration: numbers(3.0),
            yaw: -4.0,
        }),
        Command::Settings(Settings { airframe, position, attitude, rates }),
        Command::Lanes(Lanes { network: true, feedback: false }),
        Command::Arm,
        Command::Disarm,
        Command::ModelBegin { length: 54_321, checksum: 0xcbf4_3926 },
        Command::ModelChunk(ModelChunk { offset: 192, bytes: b"model\0" }),
        Command::ModelCommit,
        Command::Replan(TimedSetpoint {
            tick: 303,
            position: numbers(1.0),
            velocity: numbers(2.0),
            acceleration: numbers(3.0),
            yaw: -4.0,
        }),
        Command::Brake,
        Command::Learn(LearnOrder::Commission),
        Command::Learn(LearnOrder::Learn),
        Command::Learn(LearnOrder::Hold),
        Command::Learn(LearnOrder::Stop),
        Command::Learn(LearnOrder::Forget),
        Command::Learn(LearnOrder::Keep),
        Command::Learned { offset: 192 },
    ]
}

/// One of each report, and every outcome.
pub(super) fn reports() -> Vec<Report<'static>> {
    let trips = |first: u16| core::array::from_fn::<u16, TRIP_REASONS, _>(|i| first + i as u16);
    let flying = |slot| Some(FlyingModel { name: "figure 8", checksum: 0x0102_0304, slot });
    let reasons = [
        Reason::Undecodable,
        Reason::NotFinite,
        Reason::Attitude,
        Reason::Fractions,
        Reason::Armed,
        Reason::NotArmed,
        Reason::NoState,
        Reason::Settings,
        Reason::Setpoint { expected: -2 },
        Reason::NoModel,
        Reason::Length { limit: 192 },
        Reason::Offset { expected: 384 },
        Reason::Checksum { computed: 0x1234_5678 },
        Reason::Storage,
        Reason::Model(ModelFault::Damaged),
        Reason::Model(ModelFault::Version { found: 2 }),
        Reason::Model(ModelFault::Content),
        Reason::Model(ModelFault::Probe { index: 3 }),
        Reason::Model(ModelFault::Signal { channel: 4 }),
        Reason::Model(ModelFault::Preview { needed: 200 }),
        Reason::Model(ModelFault::Rate),
        Reason::Busy,
        Reason::Setting { what: Setting::Mass },
        Reason::Setting { what: Setting::Hover },
        Reason::Range { what: Quantity::Position },
        Reason::Range { what: Quantity::Yaw },
        Reason::Braking,
        Reason::NoLearner,
        Reason::Learner(Problem::Unknown { axis: 1 }),
        Reason::Learner(Problem::Grounded),
        Reason::Learner(Problem::Moving),
        Reason::Learner(Problem::Gap),
        Reason::Learner(Problem::Unfit { axis: 2, why: Unfit::Missing }),
        Reason::Learner(Problem::Unfit { axis: 2, why: Unfit::Speed }),
    ];
    let mut reports = vec![
        Report::Identity(Identity::new("impromptu 1", None)),
        Report::Identity(Identity::new("impromptu 1", flying(None))),
        Report::Identity(Identity::new("impromptu 1", flying(Some(1)))),
        Report::Motors(Motors { tick: 400, fractions: numbers(0.0), reference: numbers(2.0) }),
        Report::Telemetry(Telemetry {
            tick: 401,
            armed: true,
            network: LaneReport { weight: 0.25, trips: trips(1) },
            feedback: LaneReport { weight: 0.75, trips: trips(201) },
            late_inferences: 2,
            saturations: 3,
            frames: FrameReport { received: 4, damaged: 5, reordered: 6, dropped: 7 },
            tracking_error: 0.125,
            control_max: 8000,
            inference_max: 90_000,
            stack_bytes: 1000,
            entry_latency_max: 11,
            deadline_misses: 12,
        }),
        Report::Acknowledge { sequence: 255, outcome: Outcome::Done },
    ];
    reports.extend(reasons.map(|reason| Report::Acknowledge { sequence: 7, outcome: Outcome::Refused(reason) }));
    reports.push(Report::Inputs(InputReport { tick: 402, refused: 300, reach: -3, braking: true }));
    let [commissioned, learned_s, share] = [0.5, 12.5, 0.75];
    let learning = |phase, problem| LearningReport {
        phase,
        recalled: true,
        commissioned,
        learned_s,
        share,
        forgotten: 300,
        correction: numbers(-1.0),
        problem,
    };
    for phase in [Phase::Off, Phase::Commissioning, Phase::Learning, Phase::Holding] {
        reports.push(Report::Learning(learning(phase, None)));
    }
    let unfit = Problem::Unfit { axis: 1, why: Unfit::Gain };
    reports.push(Report::Learning(learning(Phase::Off, Some(unfit))));
    reports.push(Report::Learned(LearnedPiece { length: 2480, offset: 192, bytes: b"learned" }));
    reports
}

/// Payloads (sequence 0xa5) of [`commands`], then [`reports`].
const PAYLOADS: &str = "
    01a500
    01a501ac020000003f000000bf0000003f000000bf0000803f0000a03f0000c03f
    01a502ad02000080bf000040bf000000bf00000040000010400000204000004040
    01a503db040000803f0000a03f0000c03f000000400000104000002040000040400000504000006040000080c0
    01a5040000003f0000803f0000a03f0000c03f00000040000010400000204000003040000040c0000030c0000060c0000050c00000804000\
     00884000009040000098400000a0400000a84000401c450000c0400000c8400000d0400000e0400000e8400000f04000000041000004410\
     00008410000104100002041000030410000fa4305
    01a5050100
    01a506
    01a507
    01a508b1a803a6f2d0df0c
    01a509c001066d6f64656c00
    01a50a
    01a50bde040000803f0000a03f0000c03f000000400000104000002040000040400000504000006040000080c0
    01a50c
    01a50d00
    01a50d01
    01a50d02
    01a50d03
    01a50d04
    01a50d05
    01a50ec001
    01a500010b696d70726f6d707475203100
    01a500010b696d70726f6d7074752031010866696775726520388486880800
    01a500010b696d70726f6d707475203101086669677572652038848688080101
    01a5019003000000000000803e0000003f0000403f000000400000104000002040000030400000404000005040
    01a5029103010000803e01020304050607080000403fc901ca01cb01cc01cd01ce01cf01d0010203040506070000003ec03e90bf05e8070b0c
    01a503ff00
    01a503070100
    01a503070101
    01a503070102
    01a503070103
    01a503070104
    01a503070105
    01a503070106
    01a503070107
    01a50307010803
    01a503070109
    01a50307010ac001
    01a50307010b8003
    01a50307010cf8acd19101
    01a50307010d
    01a50307010e00
    01a50307010e0102
    01a50307010e02
    01a50307010e0303
    01a50307010e0404
    01a50307010e05c801
    01a50307010e06
    01a50307010f
    01a50307011000
    01a50307011012
    01a50307011100
    01a50307011104
    01a503070112
    01a503070113
    01a5030701140001
    01a50307011401
    01a50307011402
    01a50307011403
    01a503070114040200
    01a503070114040204
    01a5049203ac020501
    01a50500010000003f000048410000403fac02000080bf000040bf000000bf00
    01a50501010000003f000048410000403fac02000080bf000040bf000000bf00
    01a50502010000003f000048410000403fac02000080bf000040bf000000bf00
    01a50503010000003f000048410000403fac02000080bf000040bf000000bf00
    01a50500010000003f000048410000403fac02000080bf000040bf000000bf01040102
    01a506b013c001076c6561726e6564
";
/// One frame, with stuffing, check sum and zero.
const FRAME_OF_LANES: &str = "0501a505010530c4279e00";

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The payload in a frame of the sender, by another decoder than the receiver's.
fn payload(frame: Option<&[u8]>) -> String {
    let mut body = [0; FRAME];
    let length = cobs::decode(frame.unwrap(), &mut body).unwrap().frame_size();
    hex(&body[..length - 4])
}

#[test]
fn the_bytes_of_this_version_do_not_change() {
    let mut buffer = [0; FRAME];
    let mut payloads: Vec<_> = commands().iter().map(|command| payload(encode(command, 0xa5, &mut buffer))).collect();
    payloads.extend(reports().iter().map(|report| payload(encode(report, 0xa5, &mut buffer))));
    let lanes = hex(encode(&commands()[5], 0xa5, &mut buffer).unwrap());
    let same = payloads.iter().map(String::as_str).eq(PAYLOADS.split_whitespace()) && lanes == FRAME_OF_LANES && VERSION == 1;
    assert!(
        same,
        "the bytes of the link changed, so an older peer would misunderstand them: put them right, or raise VERSION and replace \
         the frozen bytes by these:\n{}\n\n{lanes}",
        payloads.join("\n")
    );
}

#[test]
fn the_largest_of_every_message_fits() {
    let mut buffer = [0; FRAME];
    let trips = LaneReport { weight: 1.0, trips: [u16::MAX; TRIP_REASONS] };
    let most = u32::MAX;
    let telemetry = Report::Telemetry(Telemetry {
        tick: most,
        armed: true,
        network: trips,
        feedback: trips,
        late_inferences: most,
        saturations: most,
        frames: FrameReport { received: most, damaged: most, reordered: most, dropped: most },
        tracking_error: 1.0,
        control_max: most,
        inference_max: most,
        stack_bytes: most,
        entry_latency_max: most,
        deadline_misses: most,
    });
    let name = "n".repeat(300);
    let model = FlyingModel { name: &name, checksum: most, slot: Some(u8::MAX) };
    let identity = Report::Identity(Identity::new(&name, Some(model)));
    let piece = Report::Learned(LearnedPiece { length: most, offset: most, bytes: &[1; super::CHUNK] });
    for report in [telemetry, identity, piece] {
        assert!(encode(&report, 0, &mut buffer).is_some(), "{report:?}");
    }
    let [_, _, _, _, Command::Settings(mut settings), ..] = commands() else { unreachable!() };
    settings.rates.position_divisor = most;
    let chunk = ModelChunk { offset: most, bytes: &[1; super::CHUNK] };
    for command in [Command::Settings(settings), Command::ModelChunk(chunk)] {
        assert!(encode(&command, 0, &mut buffer).is_some(), "{command:?}");
    }
    for length in 0..20 {
        assert!(encode(&commands()[1], 0, &mut buffer[..length]).is_none(), "half a frame in {length} bytes");
    }
}
