//! What a log is made of, for `train --help`.

/// Columns of a log, how to convert other logs, examples.
pub(super) const HELP: &str = "\
Files written into --out:
  NAME.impromptu     the model that `fly`, `evaluate` and the firmware load (int8)
  NAME.safetensors   the float network, NAME.json its description, NAME.rows.csv rows to calibrate on: `model-export export` makes
                     the same model file from them, and other tools can read and write them
All four are written, or what was there stays. The description names its network and rows by checksum: `model-export` refuses a
set that a power cut has mixed; the same `train` makes it whole. Too few rows for the network are refused; --force is recorded.

A log is a CSV file with a header; SI units, world frame ENU (x east, y north, z up). Columns, in any order:
  time_s                                        time, increasing, without a gap above 0.1 s
  desired_x_m, desired_y_m, desired_z_m         desired position, m
  desired_vx_m_s, desired_vy_m_s, desired_vz_m_s
                                                desired velocity, m/s
  desired_ax_m_s2, desired_ay_m_s2, desired_az_m_s2
                                                desired acceleration, m/s^2 (may be absent)
  desired_yaw_rad                               desired heading, rad (may be absent)
  reference_x_m, reference_y_m, reference_z_m   position reference that the loop received, with the dither if there is one, m
  reference_vx_m_s, reference_vy_m_s, reference_vz_m_s
                                                velocity reference that the loop received, m/s
  measured_x_m, measured_y_m, measured_z_m      position as the loop was told, as late as it was told, m
  measured_vx_m_s, measured_vy_m_s, measured_vz_m_s
                                                velocity as the loop was told, m/s
  measured_roll_rad, measured_pitch_rad, measured_yaw_rad, measured_wx_rad_s, measured_wy_rad_s, measured_wz_rad_s,
  measured_az_m_s2                              attitude, body rates and vertical acceleration as the loop was told, which
                                                are fresher than the position: its age is found from them (may be absent)
  true_x_m, true_y_m, true_z_m                  true position, m (simulators only, may be absent)
Further columns are ignored.

To convert the log of another simulator or of a real vehicle:
  1. Log once per tick of the position loop (100 Hz; other rates are interpolated), all signals at the same instant.
  2. Convert to metres and radians, and to ENU: from NED, x = east, y = north, z = -down.
  3. `measured` is what the controller used, not a smoothed or time-shifted estimate; say how old it is with --delay-ms.
  4. Without an add-on, `reference` equals `desired`, but for a dither.
  5. Begin a new file where the log has a gap, a take-off or a landing.
For the feedback lane add random steps to the position reference (1 cm, a new sign every 50 ms on each axis), log `reference` with
and `desired` without them, and give these logs as --dithered. With --vehicle the lane is chosen by flights in the simulator,
without it on models of the loop that the logs leave possible. Without dither the model has the network lane alone.

Any other loop: describe it (`host-sim describe --log X.csv` drafts the file), then `train --loop`.

Examples:
  host-sim machine servo --out servo && host-sim train --loop servo/servo.toml --log servo/*.csv --delay-ms 5 --out models
  host-sim train --log logs/*.csv --dithered dithered/*.csv --vehicle crazyflie --condition lab --out models
  host-sim train --log monday.csv tuesday.csv --delay-ms 30 --smoothing-ms 60 --name mine --out models
  host-sim train --loop gantry.toml --log gantry-*.csv --axis x --out models
  host-sim train --log logs/*.csv --recipe quick.toml --seed 7 --out models";
