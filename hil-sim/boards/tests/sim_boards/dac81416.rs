//! The DAC81416 model against the facts it was written from.

use hil_sim_boards::dac81416::{CHANNELS, Dac81416, Fault, PRODUCT, register as r};

/// SPICONFIG as reset leaves it, without DEV-PWDWN.
const ACTIVE: u16 = 0x0A84;
const STREAMING: u16 = ACTIVE | 1 << 3;
const REFERENCE_ON: u16 = 0x3F00;
/// Four channels at ±5 V.
const FIVE_VOLTS: u16 = 0x9999;
const ZERO_VOLTS: u16 = 0x8000;

/// One frame; returns what SDO said.
fn frame(chip: &mut Dac81416, mosi: &[u8]) -> Vec<u8> {
    chip.select();
    let miso = mosi.iter().map(|&byte| chip.transfer(byte)).collect();
    chip.deselect();
    miso
}

fn write(chip: &mut Dac81416, address: u8, data: u16) {
    let [high, low] = data.to_be_bytes();
    frame(chip, &[address, high, low]);
}

fn read(chip: &mut Dac81416, address: u8) -> u16 {
    frame(chip, &[0x80 | address, 0, 0]);
    let answer = frame(chip, &[r::NOP, 0, 0]);
    assert_eq!(answer[0], 0x80 | address);
    u16::from_be_bytes([answer[1], answer[2]])
}

fn stream(chip: &mut Dac81416, first: u8, words: &[u16]) {
    let mut bytes = vec![first];
    bytes.extend(words.iter().flat_map(|word| word.to_be_bytes()));
    frame(chip, &bytes);
}

fn pulse_ldac(chip: &mut Dac81416) {
    chip.ldac(false);
    chip.ldac(true);
}

/// A chip with every channel on, at ±5 V and 0 V, without LDAC.
fn running() -> Dac81416 {
    let mut chip = Dac81416::new();
    write(&mut chip, r::SPICONFIG, ACTIVE);
    write(&mut chip, r::GENCONFIG, REFERENCE_ON);
    for register in r::DACRANGE0..=r::DACRANGE3 {
        write(&mut chip, register, FIVE_VOLTS);
    }
    write(&mut chip, r::BRDCAST, ZERO_VOLTS);
    write(&mut chip, r::DACPWDWN, 0);
    assert_eq!(chip.faults(), []);
    chip
}

fn voltages(chip: &Dac81416) -> Vec<f64> {
    (0..CHANNELS).map(|channel| chip.voltage(channel)).collect()
}

#[test]
fn it_wakes_powered_down_at_zero_volts() {
    let mut chip = Dac81416::new();
    assert_eq!(voltages(&chip), [0.0; CHANNELS]);
    assert_eq!(read(&mut chip, r::SPICONFIG), 0x0AA4);
    assert_eq!(read(&mut chip, r::DEVICEID) >> 2, PRODUCT);
    assert_eq!(read(&mut chip, r::DACPWDWN), 0xFFFF);
    // Words alone move nothing.
    write(&mut chip, r::BRDCAST, 0xFFFF);
    assert_eq!(voltages(&chip), [0.0; CHANNELS]);
    assert_eq!(chip.word(3), 0xFFFF);
}

#[test]
fn an_output_needs_device_reference_and_channel_power() {
    for (register, down) in [
        (r::SPICONFIG, ACTIVE | 1 << 5),
        (r::GENCONFIG, REFERENCE_ON | 1 << 14),
        (r::DACPWDWN, 1 << 5),
    ] {
        let mut chip = running();
        write(&mut chip, r::DAC0 + 5, 0xC000);
        assert_eq!(chip.voltage(5), 2.5);
        write(&mut chip, register, down);
        assert_eq!(chip.voltage(5), 0.0, "register {register:#04x}");
        assert_eq!(chip.word(5), 0xC000);
    }
    let mut chip = running();
    write(&mut chip, r::BRDCAST, 0xC000);
    write(&mut chip, r::DACPWDWN, 1 << 5);
    assert_eq!((chip.voltage(4), chip.voltage(5)), (2.5, 0.0));
}

#[test]
fn every_range_spans_its_volts() {
    for (code, lowest_v, middle_v) in [
        (0x0, 0.0, 2.5),
        (0x1, 0.0, 5.0),
        (0x2, 0.0, 10.0),
        (0x4, 0.0, 20.0),
        (0x9, -5.0, 0.0),
        (0xA, -10.0, 0.0),
        (0xC, -20.0, 0.0),
        (0xE, -2.5, 0.0),
    ] {
        let mut chip = running();
        write(&mut chip, r::DACRANGE3, code << 8);
        // Channel 2 has bits 11 to 8 of the last register.
        write(&mut chip, r::DAC0 + 2, 0);
        assert_eq!(chip.voltage(2), lowest_v, "code {code:#x}");
        write(&mut chip, r::DAC0 + 2, 0x8000);
        assert_eq!(chip.voltage(2), middle_v, "code {code:#x}");
        // One step short of the top.
        write(&mut chip, r::DAC0 + 2, 0xFFFF);
        let step_v = 2.0 * (middle_v - lowest_v) / 65_536.0;
        assert_eq!(
            chip.voltage(2),
            2.0 * middle_v - lowest_v - step_v,
            "code {code:#x}"
        );
        assert_eq!(chip.faults(), []);
    }
}

#[test]
fn range_registers_hold_four_channels_each_from_the_last_down() {
    for channel in 0..CHANNELS {
        let mut chip = running();
        for register in r::DACRANGE0..=r::DACRANGE3 {
            write(&mut chip, register, 0);
        }
        let register = r::DACRANGE3 - (channel / 4) as u8;
        write(&mut chip, register, 0xA << (4 * (channel % 4)));
        write(&mut chip, r::BRDCAST, 0);
        let mut expected = [0.0; CHANNELS];
        expected[channel] = -10.0;
        assert_eq!(voltages(&chip), expected);
    }
}

#[test]
fn a_code_that_is_no_range_is_a_fault_and_zero_volts() {
    let mut chip = running();
    write(&mut chip, r::DACRANGE3 - 1, 0x9993);
    write(&mut chip, r::BRDCAST, 0xFFFF);
    assert_eq!(
        chip.faults(),
        [Fault::NoRange {
            channel: 4,
            code: 3
        }]
    );
    assert_eq!(chip.voltage(4), 0.0);
    assert!(chip.voltage(5) > 4.9);
}

#[test]
fn a_channel_follows_at_once_or_waits_for_ldac_as_syncconfig_says() {
    let mut chip = running();
    write(&mut chip, r::SYNCCONFIG, 1 << 3);
    write(&mut chip, r::DAC0 + 2, 0xC000);
    write(&mut chip, r::DAC0 + 3, 0xC000);
    assert_eq!((chip.voltage(2), chip.voltage(3)), (2.5, 0.0));
    assert_eq!(chip.word(3), ZERO_VOLTS);
    assert_eq!(read(&mut chip, r::DAC0 + 3), 0xC000);
    chip.ldac(false);
    assert_eq!(chip.voltage(3), 2.5);
    // Neither a low level nor the rising edge loads.
    write(&mut chip, r::DAC0 + 3, 0x4000);
    chip.ldac(false);
    chip.ldac(true);
    assert_eq!(chip.voltage(3), 2.5);
    chip.ldac(false);
    assert_eq!(chip.voltage(3), -2.5);
    assert_eq!(chip.counters().loads, 2);
}

#[test]
fn trigger_loads_as_the_pin_does() {
    let mut chip = running();
    write(&mut chip, r::SYNCCONFIG, 0xFFFF);
    write(&mut chip, r::BRDCAST, 0xC000);
    assert_eq!(voltages(&chip), [0.0; CHANNELS]);
    write(&mut chip, r::TRIGGER, 1 << 4);
    assert_eq!(voltages(&chip), [2.5; CHANNELS]);
}

#[test]
fn a_broadcast_while_streaming_fills_the_channels_that_brdconfig_names_and_waits_for_ldac() {
    let mut chip = running();
    write(&mut chip, r::SYNCCONFIG, 0xFFFF);
    write(&mut chip, r::BRDCONFIG, 0x1FFF);
    write(&mut chip, r::SPICONFIG, STREAMING);
    stream(&mut chip, r::BRDCAST, &[0xC000]);
    assert_eq!(voltages(&chip), [0.0; CHANNELS]);
    pulse_ldac(&mut chip);
    let expected: [f64; CHANNELS] =
        std::array::from_fn(|channel| if channel < 13 { 2.5 } else { 0.0 });
    assert_eq!(voltages(&chip), expected);
    assert_eq!(chip.faults(), []);
}

#[test]
fn a_soft_reset_returns_to_power_up() {
    for code in [0x000A, 0x1010] {
        let mut chip = running();
        write(&mut chip, r::BRDCAST, 0xC000);
        write(&mut chip, r::TRIGGER, code);
        assert_eq!(voltages(&chip), [0.0; CHANNELS]);
        assert_eq!(read(&mut chip, r::SPICONFIG), 0x0AA4);
        assert_eq!(chip.word(0), 0);
    }
}

#[test]
fn a_broadcast_reaches_the_channels_of_brdconfig() {
    let mut chip = running();
    write(&mut chip, r::BRDCONFIG, 0x8001);
    write(&mut chip, r::BRDCAST, 0xC000);
    let mut expected = [0.0; CHANNELS];
    expected[0] = 2.5;
    expected[15] = 2.5;
    assert_eq!(voltages(&chip), expected);
}

#[test]
fn streaming_fills_channels_upwards_and_one_ldac_moves_them_together() {
    let mut chip = running();
    write(&mut chip, r::SYNCCONFIG, 0xFFFF);
    write(&mut chip, r::SPICONFIG, STREAMING);
    let words: Vec<u16> = (0..13).map(|channel| ZERO_VOLTS + 100 * channel).collect();
    stream(&mut chip, r::DAC0, &words);
    assert_eq!(voltages(&chip), [0.0; CHANNELS]);
    pulse_ldac(&mut chip);
    for (channel, word) in words.iter().enumerate() {
        assert_eq!(chip.word(channel), *word);
    }
    assert_eq!(
        [13, 14, 15].map(|channel| chip.word(channel)),
        [ZERO_VOLTS; 3]
    );
    // From the middle.
    stream(&mut chip, r::DAC0 + 14, &[1, 2]);
    pulse_ldac(&mut chip);
    assert_eq!(
        [13, 14, 15].map(|channel| chip.word(channel)),
        [ZERO_VOLTS, 1, 2]
    );
    assert_eq!(chip.faults(), []);
}

#[test]
fn streaming_stops_behind_the_last_channel() {
    let mut chip = running();
    write(&mut chip, r::SPICONFIG, STREAMING);
    stream(&mut chip, r::DAC0 + 14, &[1, 2, 3, 4]);
    assert_eq!(
        [0, 1, 14, 15].map(|channel| chip.word(channel)),
        [ZERO_VOLTS, ZERO_VOLTS, 1, 2]
    );
    assert_eq!(chip.faults(), [Fault::BeyondLastChannel(2)]);
    // However long a frame is.
    frame(&mut chip, &[0x10; 1_001]);
    assert_eq!(chip.faults()[1], Fault::BeyondLastChannel(500 - 16));
}

#[test]
fn sdo_is_silent_while_streaming_and_speaks_again_after_it() {
    let mut chip = running();
    write(&mut chip, r::SPICONFIG, STREAMING);
    frame(&mut chip, &[0x80 | r::DEVICEID, 0, 0]);
    assert_eq!(frame(&mut chip, &[r::NOP, 0, 0]), [0xFF; 3]);
    assert_eq!(chip.faults(), [Fault::ReadWhileStreaming(r::DEVICEID)]);
    // One word for SPICONFIG is a stream too.
    write(&mut chip, r::SPICONFIG, ACTIVE);
    assert_eq!(read(&mut chip, r::DEVICEID), PRODUCT << 2);
}

#[test]
fn an_answer_comes_in_the_next_frame_only_and_only_with_sdo_on() {
    let mut chip = running();
    assert_eq!(frame(&mut chip, &[0x80 | r::SPICONFIG, 0, 0]), [0; 3]);
    assert_eq!(
        frame(&mut chip, &[r::NOP, 0, 0]),
        [0x80 | r::SPICONFIG, 0x0A, 0x84]
    );
    assert_eq!(frame(&mut chip, &[r::NOP, 0, 0]), [0; 3]);
    write(&mut chip, r::SPICONFIG, ACTIVE & !(1 << 2));
    frame(&mut chip, &[0x80 | r::SPICONFIG, 0, 0]);
    assert_eq!(frame(&mut chip, &[r::NOP, 0, 0]), [0xFF; 3]);
}

#[test]
fn ranges_and_triggers_cannot_be_read() {
    let mut chip = running();
    assert_eq!(read(&mut chip, r::DACRANGE0), 0);
    assert_eq!(read(&mut chip, r::TRIGGER), 0);
}

#[test]
fn clr_holds_every_channel_at_zero_volts_and_leaves_it_there() {
    let mut chip = running();
    write(&mut chip, r::DACRANGE3, 0x9990);
    write(&mut chip, r::SYNCCONFIG, 0x00FF);
    write(&mut chip, r::BRDCAST, 0xC000);
    pulse_ldac(&mut chip);
    write(&mut chip, r::BRDCAST, 0xF000);
    chip.clr(true);
    assert_eq!(voltages(&chip), [0.0; CHANNELS]);
    // Channel 0 is unipolar.
    assert_eq!((chip.word(0), chip.word(1)), (0, ZERO_VOLTS));
    // Neither a write nor LDAC gets through, and what waited for LDAC is gone. To write 0 V changes
    // nothing and is no fault.
    write(&mut chip, r::DAC0 + 15, 0xFFFF);
    write(&mut chip, r::DAC0 + 15, ZERO_VOLTS);
    pulse_ldac(&mut chip);
    assert_eq!(voltages(&chip), [0.0; CHANNELS]);
    assert_eq!(chip.faults(), [Fault::HeldByClear(r::DAC0 + 15)]);

    chip.clr(false);
    pulse_ldac(&mut chip);
    assert_eq!(voltages(&chip), [0.0; CHANNELS]);
    write(&mut chip, r::DAC0 + 15, 0xC000);
    assert_eq!(chip.voltage(15), 2.5);
}

#[test]
fn a_range_set_while_clr_is_low_is_cleared_to_its_own_zero() {
    let mut chip = Dac81416::new();
    chip.clr(true);
    write(&mut chip, r::SPICONFIG, ACTIVE);
    write(&mut chip, r::GENCONFIG, REFERENCE_ON);
    for register in r::DACRANGE0..=r::DACRANGE3 {
        write(&mut chip, register, FIVE_VOLTS);
    }
    write(&mut chip, r::DACPWDWN, 0);
    chip.clr(false);
    assert_eq!(voltages(&chip), [0.0; CHANNELS]);
}

#[test]
fn a_bipolar_channel_powered_up_before_it_was_written_gives_its_lowest_voltage() {
    let mut chip = Dac81416::new();
    write(&mut chip, r::SPICONFIG, ACTIVE);
    write(&mut chip, r::GENCONFIG, REFERENCE_ON);
    write(&mut chip, r::DACRANGE3, FIVE_VOLTS);
    write(&mut chip, r::DACPWDWN, !1);
    assert_eq!(chip.voltage(0), -5.0);
}

#[test]
fn frames_of_a_wrong_length_are_ignored_and_counted() {
    let mut chip = running();
    let before = chip.counters();
    for bytes in [1, 2, 4, 27, 500] {
        frame(&mut chip, &vec![r::DAC0; bytes]);
        assert_eq!(chip.faults().last(), Some(&Fault::Length(bytes)));
    }
    assert_eq!(voltages(&chip), [0.0; CHANNELS]);
    assert_eq!(chip.counters().malformed, before.malformed + 5);
    assert_eq!(chip.counters().frames, before.frames + 5);
    // A select without a clock is no frame.
    frame(&mut chip, &[]);
    assert_eq!(chip.counters().malformed, before.malformed + 5);
    assert_eq!(chip.counters().frames, before.frames + 5);
}

#[test]
fn half_a_word_at_the_end_of_a_stream_is_ignored_and_counted() {
    let mut chip = running();
    write(&mut chip, r::SPICONFIG, STREAMING);
    frame(&mut chip, &[r::DAC0, 0xC0, 0x00, 0xC0]);
    assert_eq!((chip.voltage(0), chip.voltage(1)), (2.5, 0.0));
    frame(&mut chip, &[r::DAC0]);
    assert_eq!(
        chip.faults(),
        [Fault::PartialWord(4), Fault::PartialWord(1)]
    );
    assert_eq!(chip.counters().malformed, 2);
}

#[test]
fn what_cannot_be_written_or_is_left_out_is_a_fault() {
    let mut chip = running();
    assert_eq!(chip.transfer(0x55), 0xFF);
    write(&mut chip, r::DEVICEID, 1);
    write(&mut chip, 0x3E, 1);
    frame(&mut chip, &[0x80 | 0x3E, 0, 0]);
    write(&mut chip, r::SPICONFIG, ACTIVE | 1 << 4);
    write(&mut chip, r::GENCONFIG, REFERENCE_ON | 1);
    assert_eq!(
        chip.faults(),
        [
            Fault::NotSelected,
            Fault::ReadOnly(r::DEVICEID),
            Fault::NoRegister(0x3E),
            Fault::NoRegister(0x3E),
            Fault::NotModelled {
                address: r::SPICONFIG,
                bits: 1 << 4
            },
            Fault::NotModelled {
                address: r::GENCONFIG,
                bits: 1
            },
        ]
    );
    assert_eq!(read(&mut chip, r::DEVICEID), PRODUCT << 2);
}

#[test]
fn faults_are_counted_beyond_those_that_are_kept() {
    let mut chip = running();
    for _ in 0..1_000 {
        frame(&mut chip, &[0]);
    }
    assert_eq!(chip.counters().faults, 1_000);
    assert_eq!(chip.faults().len(), 32);
}
