//! A DAC81416 that is broken on purpose: what is wrong shows, and nothing else does.

use hil_sim_boards::dac81416::{Dac81416, register as r};

const ACTIVE: u16 = 0x0A84;
/// Without TEMPALM-EN.
const QUIET: u16 = 0x0284;
const TEMPERATURE_ALARM: u16 = 1;

fn frame(chip: &mut Dac81416, mosi: [u8; 3]) -> [u8; 3] {
    chip.select();
    let miso = mosi.map(|byte| chip.transfer(byte));
    chip.deselect();
    miso
}

fn write(chip: &mut Dac81416, address: u8, data: u16) {
    let [high, low] = data.to_be_bytes();
    frame(chip, [address, high, low]);
}

fn read(chip: &mut Dac81416, address: u8) -> u16 {
    frame(chip, [0x80 | address, 0, 0]);
    let [_, high, low] = frame(chip, [r::NOP, 0, 0]);
    u16::from_be_bytes([high, low])
}

/// A chip with every channel at ±5 V and 2.5 V, waiting for LDAC.
fn running() -> Dac81416 {
    let mut chip = Dac81416::new();
    write(&mut chip, r::SPICONFIG, ACTIVE);
    write(&mut chip, r::GENCONFIG, 0x3F00);
    for register in r::DACRANGE0..=r::DACRANGE3 {
        write(&mut chip, register, 0x9999);
    }
    write(&mut chip, r::BRDCAST, 0xC000);
    write(&mut chip, r::SYNCCONFIG, 0xFFFF);
    write(&mut chip, r::DACPWDWN, 0);
    assert_eq!((chip.voltage(3), chip.faults()), (2.5, &[][..]));
    chip
}

#[test]
fn a_deaf_chip_hears_nothing_says_nothing_and_keeps_its_voltages() {
    let mut chip = running();
    chip.defects.deaf = true;
    write(&mut chip, r::BRDCAST, 0x8000);
    chip.ldac(false);
    assert_eq!(chip.voltage(3), 2.5);
    assert_eq!(frame(&mut chip, [0x81, 0, 0]), [0xFF; 3]);
    assert_eq!(frame(&mut chip, [r::NOP, 0, 0]), [0xFF; 3]);
    // Its other pins are alive.
    chip.clr(true);
    assert_eq!(chip.voltage(3), 0.0);
}

#[test]
fn without_ldac_the_buffers_follow_and_the_outputs_do_not() {
    let mut chip = running();
    chip.defects.no_load = true;
    write(&mut chip, r::DAC0 + 3, 0xE000);
    chip.ldac(false);
    assert_eq!(
        (chip.voltage(3), read(&mut chip, r::DAC0 + 3)),
        (2.5, 0xE000)
    );
    chip.defects.no_load = false;
    chip.ldac(true);
    chip.ldac(false);
    assert_eq!(chip.voltage(3), 3.75);
}

#[test]
fn heat_is_told_by_the_status_and_by_the_line_if_it_is_asked_to() {
    let mut chip = running();
    assert!(!chip.alarm());
    chip.defects.overheated = true;
    assert!(chip.alarm());
    assert_eq!(read(&mut chip, r::STATUS), TEMPERATURE_ALARM);
    write(&mut chip, r::SPICONFIG, QUIET);
    assert!(!chip.alarm());
    assert_eq!(read(&mut chip, r::STATUS), TEMPERATURE_ALARM);
    chip.defects.overheated = false;
    assert_eq!(read(&mut chip, r::STATUS), 0);
}

#[test]
fn a_stuck_output_is_one_channels_and_nothing_moves_it() {
    let mut chip = running();
    chip.defects.stuck_output = Some((7, -1.5));
    chip.clr(true);
    assert_eq!((chip.voltage(6), chip.voltage(7)), (0.0, -1.5));
}

#[test]
fn power_that_was_lost_leaves_every_register_as_at_power_up() {
    let mut chip = running();
    chip.reset();
    assert_eq!(chip.voltage(3), 0.0);
    assert_eq!(read(&mut chip, r::SPICONFIG), 0x0AA4);
    assert_eq!(read(&mut chip, r::DACPWDWN), 0xFFFF);
    assert_eq!(read(&mut chip, r::DAC0 + 3), 0);
}
