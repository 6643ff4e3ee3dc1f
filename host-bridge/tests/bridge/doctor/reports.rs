//! The report for people and the one for scripts.

use host_bridge::doctor::findings;
use host_bridge::doctor::json;
use host_bridge::doctor::report;
use host_bridge::doctor::report::Style;
use host_bridge::state::State;
use serde_json::Value;

use super::bench::bench;

#[test]
fn a_bench_that_is_well_has_no_findings() {
    assert_eq!(findings::of(&bench()), []);
}

#[test]
fn the_report_for_people_reads_well_in_eighty_columns() {
    let mut bench = bench();
    bench.boards[1].restarts = 1;
    bench.boards[1].state = State::Absent(
        "/dev/serial/by-id/usb-STMicroelectronics_STM32_STLink_066CFF484971754867083829-if02"
            .to_owned(),
    );
    let findings = findings::of(&bench);
    let expected = format!(
        "\
host-bridge 0.1.0, protocol 7, schema {:016x}

attached
  ST-LINK 066C: /dev/tty-sensor
  probe 0483:374b:066C STLink V2-1

sensor
  port         /dev/tty-sensor: sensor 0.1.0 on stm32f429zi
  bench's ELF  /elves/firmware-sensor: sensor 0.1.0 on stm32f429zi
  up           1 min 32 s, started by power, no watchdog reset
  arm          free
  gauges 0-4   good, good, good, good, good
  clock        -1.500000 s to this program's, drifts +30 ± 40 ppm
  round trip   0.9 ms
  says         100 estimates a second
  other board  1000 frames heard from it

display
  port         /dev/serial/by-id/usb-STMicroelectronics_STM32_STLink_066CFF484971754867083829-if02:
               not there
  bench's ELF  /elves/firmware-display: display 0.1.0 on stm32f429zi

1 finding
  1. display:
     /dev/serial/by-id/usb-STMicroelectronics_STM32_STLink_066CFF484971754867083829-if02:
     not there
     -> plug the board in at its ST-LINK's USB socket, or name its port with
        --sensor or --display
",
        protocol::SCHEMA_HASH
    );
    assert_eq!(report::write(&bench, &findings, Style::Plain), expected);
    let coloured = report::write(&bench, &findings, Style::Terminal);
    assert!(
        coloured.contains("\x1b[1;31m1 finding\x1b[0m"),
        "{coloured}"
    );
}

#[test]
fn a_bench_that_is_well_is_told_so() {
    let report = report::write(&bench(), &[], Style::Plain);
    assert!(report.ends_with("\n\nall well\n"), "{report}");
    assert!(report.contains("  supervisor   ready\n"), "{report}");
}

#[test]
fn the_report_for_scripts_keeps_its_shape() {
    let mut bench = bench();
    bench.boards[1].state = State::Busy("/dev/ttyACM1".into());
    let findings = findings::of(&bench);
    let document: Value =
        serde_json::from_str(&json::write(&bench, &findings)).expect("well-formed");
    let keys = |value: &Value| -> Vec<String> {
        value
            .as_object()
            .map(|fields| fields.keys().cloned().collect())
            .unwrap_or_default()
    };
    assert_eq!(
        keys(&document),
        [
            "boards", "findings", "format", "looked_s", "probes", "program", "st_links", "well"
        ]
    );
    assert_eq!(document["format"], 1);
    assert_eq!(document["well"], false);
    assert_eq!(document["probes"][0]["usb"], "0483:374b");
    assert_eq!(document["st_links"][0]["port"], "/dev/tty-sensor");
    let [sensor, display] = [0, 1].map(|at| &document["boards"][at]);
    assert_eq!(
        keys(sensor),
        [
            "arm",
            "clock",
            "counters",
            "elf",
            "gauges",
            "hello",
            "losses",
            "missed_at_handover",
            "peer_frames",
            "port",
            "rate_hz",
            "reset",
            "restarts",
            "role",
            "state",
            "supervisor",
            "this_end",
            "uptime_s",
            "watchdog_resets"
        ]
    );
    assert_eq!(sensor["state"], "known");
    assert_eq!(sensor["hello"]["version"], "0.1.0");
    assert_eq!(
        sensor["hello"]["schema"],
        format!("{:016x}", protocol::SCHEMA_HASH)
    );
    assert_eq!(sensor["uptime_s"], 92.0);
    assert_eq!(sensor["reset"], "power");
    assert_eq!(sensor["gauges"][4], "good");
    assert_eq!(sensor["supervisor"], Value::Null);
    assert_eq!(sensor["arm"], "free");
    assert_eq!(sensor["counters"]["role"]["stopped"], Value::Null);
    assert_eq!(sensor["peer_frames"], 1_000);
    assert_eq!(sensor["counters"]["peer"]["received"], 5_000);
    assert_eq!(sensor["counters"]["role"]["adc_overruns"], 0);
    assert_eq!(sensor["clock"]["drift_ppm"], 30.0);
    assert_eq!(sensor["elf"]["error"], Value::Null);
    assert_eq!(display["state"], "busy");
    assert_eq!(display["supervisor"], "ready");
    assert_eq!(display["counters"]["role"]["state"], Value::Null);
    assert_eq!(
        document["findings"],
        serde_json::json!([{
            "board": "display",
            "kind": "busy",
            "what": "/dev/ttyACM1: another program has it",
            "advice": "close the other program (tio, screen, or one of another user's)",
        }])
    );
}
