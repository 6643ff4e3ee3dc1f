//! A chip behind a probe: looked at, written, started.

use std::sync::{Arc, Mutex, MutexGuard};

use host_bridge::flash::firmware::Firmware;
use host_bridge::flash::plan::Plan;
use host_bridge::flash::programmer::Trouble;
use host_bridge::flash::programmer::{Programmer, Progress, Stage};
use probe_rs::integration::FakeProbe;
use protocol::Role;

use super::chip::{Chip, DEVICE_ID, Deed, FLASH_SIZE, OPTIONS, OPTIONS_1, probe};
use super::elf::{Elf, FLASH, program};

/// A plan that takes sectors 0, 1 and 4, and the chip for it.
fn bench(name: &str) -> (Plan, Arc<Mutex<Chip>>) {
    let path = Elf::of(Role::Sensor)
        .with_parts(vec![
            (FLASH, program(20_000)),
            (FLASH + 0x1_0000, program(1_500)),
        ])
        .write(name);
    let firmware = Firmware::read(&path, Role::Sensor).expect("a firmware");
    let plan = Plan::new(firmware).expect("it fits");
    let chip = Chip::new(&plan.target);
    (plan, chip)
}

fn seen(chip: &Arc<Mutex<Chip>>) -> MutexGuard<'_, Chip> {
    chip.lock().expect("nobody panicked with it")
}

/// What is said of the chip, to which nothing may have been done.
fn refusal(plan: &Plan, chip: &Arc<Mutex<Chip>>) -> Trouble {
    let trouble = Programmer::attach(probe(chip), plan, || Some(probe(chip)))
        .expect_err("the chip is refused");
    assert!(trouble.is_harmless(), "{trouble}");
    let flash = |deed: &Deed| matches!(deed, Deed::Erased(_) | Deed::Written(_));
    assert!(!seen(chip).deeds.iter().any(flash), "{trouble}");
    trouble
}

#[test]
fn a_chip_is_erased_written_verified_and_started() {
    let (plan, chip) = bench("programmed");
    let mut programmer = Programmer::attach(probe(&chip), &plan, || None).expect("the right chip");
    let mut told = Vec::new();
    programmer
        .write(&plan, |progress| told.push(progress))
        .expect("it can be written");
    programmer.start().expect("it can be started");

    let chip = seen(&chip);
    for segment in &plan.firmware.segments {
        let start = (segment.address - u64::from(FLASH)) as usize;
        assert_eq!(chip.flash[start..][..segment.bytes.len()], segment.bytes);
    }
    // What lies in between is erased, what lies behind untouched.
    assert!(chip.flash[20_480..0x8000].iter().all(|&byte| byte == 0xFF));
    assert!(
        chip.flash[0x8000..0x1_0000]
            .iter()
            .all(|&byte| byte == 0x5A)
    );
    assert!(chip.flash[0x2_0000..].iter().all(|&byte| byte == 0x5A));
    let erased: Vec<u64> = chip
        .deeds
        .iter()
        .filter_map(|deed| match deed {
            Deed::Erased(address) => Some(*address),
            _ => None,
        })
        .collect();
    let planned: Vec<u64> = plan.sectors.iter().map(|sector| sector.address).collect();
    assert_eq!(erased, planned);
    let written = chip
        .deeds
        .iter()
        .filter(|deed| matches!(deed, Deed::Written(_)));
    assert_eq!(written.count(), plan.pages);
    assert_eq!(chip.deeds.last(), Some(&Deed::Reset));
    assert!(chip.is_running);

    let ends = |stage, total_bytes| Progress {
        stage,
        done_bytes: total_bytes,
        total_bytes,
    };
    let page_bytes = plan.page_bytes * plan.pages as u64;
    assert!(
        told.contains(&ends(
            Stage::Erase,
            plan.sectors.iter().map(|sector| sector.bytes).sum()
        )),
        "{told:?}"
    );
    assert!(told.contains(&ends(Stage::Write, page_bytes)), "{told:?}");
    assert_eq!(told.last(), Some(&ends(Stage::Verify, page_bytes)));
    assert!(
        told.iter()
            .all(|progress| progress.done_bytes <= progress.total_bytes)
    );
}

#[test]
fn another_chip_is_refused_by_name() {
    let (plan, chip) = bench("other-chip");
    for (device, name) in [
        (0x1003_6413, "STM32F405/407"),
        (0x1000_6451, "STM32F765/767"),
        (0x0000_0000, "device 0x000"),
    ] {
        seen(&chip).set_word(DEVICE_ID, device);
        let trouble = refusal(&plan, &chip);
        assert!(matches!(trouble, Trouble::OtherChip { .. }), "{trouble:?}");
        assert!(trouble.to_string().contains(name), "{trouble}");
    }
}

#[test]
fn a_locked_chip_is_refused_and_not_unlocked() {
    let (plan, chip) = bench("locked");
    for (options, wanted) in [(0x0FFF_55ED, 1), (0x0FFF_CCED, 2)] {
        seen(&chip).set_word(OPTIONS, options);
        match refusal(&plan, &chip) {
            Trouble::Locked { level } => assert_eq!(level, wanted),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn a_write_protected_sector_is_refused_if_it_is_needed() {
    let (plan, chip) = bench("protected");
    seen(&chip).set_word(OPTIONS, 0x0FEF_AAED);
    match refusal(&plan, &chip) {
        Trouble::Protected(sector) => assert_eq!(sector, 4),
        other => panic!("{other:?}"),
    }
    // Sectors 2 and 12 are not needed.
    seen(&chip).set_word(OPTIONS, 0x0FFB_AAED);
    seen(&chip).set_word(OPTIONS_1, 0x0FFE_0000);
    Programmer::attach(probe(&chip), &plan, || None).expect("what is needed can be written");
}

#[test]
fn a_chip_with_less_flash_is_refused() {
    let (plan, chip) = bench("small");
    seen(&chip).set_word(FLASH_SIZE, 64 << 16);
    let trouble = refusal(&plan, &chip);
    assert!(trouble.to_string().contains("64 KiB"), "{trouble}");
}

#[test]
fn a_board_without_power_is_refused() {
    let (plan, chip) = bench("powerless");
    seen(&chip).volts = 0.1;
    let trouble = refusal(&plan, &chip);
    assert!(matches!(trouble, Trouble::NoPower { .. }), "{trouble:?}");
}

#[test]
fn a_chip_that_does_not_answer_is_tried_under_reset_and_then_refused() {
    let (plan, chip) = bench("silent");
    seen(&chip).is_there = false;
    let mut reopened = false;
    let trouble = Programmer::attach(probe(&chip), &plan, || {
        reopened = true;
        Some(probe(&chip))
    })
    .expect_err("nobody answers");
    assert!(reopened);
    assert!(matches!(trouble, Trouble::NoAnswer { .. }), "{trouble:?}");
    assert!(trouble.to_string().contains("CN4"), "{trouble}");
}

#[test]
fn a_byte_that_does_not_hold_what_was_written_is_found() {
    let (plan, chip) = bench("unverified");
    // Bit 0 of this byte is to be 0.
    let at = (8..20_000)
        .find(|&at| plan.firmware.segments[0].bytes[at] & 1 == 0)
        .expect("an even byte");
    seen(&chip).broken_byte = Some(at);
    let mut programmer = Programmer::attach(probe(&chip), &plan, || None).expect("the right chip");
    let trouble = programmer
        .write(&plan, |_| {})
        .expect_err("one bit is wrong");
    assert!(matches!(trouble, Trouble::Unverified), "{trouble:?}");
    assert!(!trouble.is_harmless());
}

#[test]
fn a_sector_that_can_not_be_erased_is_said_and_leaves_no_doubt() {
    let (plan, chip) = bench("stubborn");
    seen(&chip).stubborn_sector = Some(u64::from(FLASH) + 0x4000);
    let mut programmer = Programmer::attach(probe(&chip), &plan, || None).expect("the right chip");
    let trouble = programmer.write(&plan, |_| {}).expect_err("it stays");
    let text = trouble.to_string();
    assert!(
        text.contains("erasing failed") && text.contains("0x08004000"),
        "{text}"
    );
    assert!(!trouble.is_harmless());
}

#[test]
fn a_cable_pulled_while_writing_is_said() {
    let (plan, chip) = bench("pulled");
    let mut programmer = Programmer::attach(probe(&chip), &plan, || None).expect("the right chip");
    let trouble = programmer
        .write(&plan, |progress| {
            if progress.stage == Stage::Write {
                seen(&chip).is_there = false;
            }
        })
        .expect_err("the chip is gone");
    let text = trouble.to_string();
    assert!(text.contains("no whole firmware"), "{text}");
    assert!(!trouble.is_harmless());
}

#[test]
fn a_cable_pulled_before_the_first_sector_does_no_harm() {
    let (plan, chip) = bench("pulled-early");
    let mut programmer = Programmer::attach(probe(&chip), &plan, || None).expect("the right chip");
    seen(&chip).is_there = false;
    let trouble = programmer
        .write(&plan, |_| {})
        .expect_err("the chip is gone");
    assert!(matches!(trouble, Trouble::LostBefore { .. }), "{trouble:?}");
    assert!(trouble.is_harmless());
}

#[test]
fn a_chip_that_does_not_take_its_reset_is_said() {
    let (plan, chip) = bench("unstarted");
    let mut programmer = Programmer::attach(probe(&chip), &plan, || None).expect("the right chip");
    programmer.write(&plan, |_| {}).expect("it can be written");
    seen(&chip).is_there = false;
    let trouble = programmer.start().expect_err("the chip is gone");
    assert!(matches!(trouble, Trouble::NotStarted { .. }), "{trouble:?}");
    assert!(trouble.to_string().contains("reset button"), "{trouble}");
}

/// As far as probe-rs's own fake probe reaches: an attached session whose memory reads as an ELF's.
#[test]
fn probe_rs_fake_probe_shows_its_chip_and_no_more() {
    let (plan, _) = bench("faked");
    // The identity, the size of the flash and the option bytes; each word in a part of its own, and each
    // part a word longer, since the fake leaves out the last.
    let word = |address: u64, word: u32| (address as u32, [word.to_le_bytes(), [0; 4]].concat());
    let fake = |device: u32| {
        let memory = Elf::of(Role::Sensor)
            .with_parts(vec![
                word(DEVICE_ID, device),
                word(FLASH_SIZE, 2048 << 16),
                (
                    OPTIONS as u32,
                    [
                        0x0FFF_AAEDu32.to_le_bytes(),
                        0x0FFF_0000u32.to_le_bytes(),
                        [0; 4],
                    ]
                    .concat(),
                ),
            ])
            .write(&format!("fake-{device:x}"));
        FakeProbe::with_mocked_core_and_binary(&memory).into_probe()
    };
    Programmer::attach(fake(0x2003_6419), &plan, || None).expect("our chip");
    let trouble = Programmer::attach(fake(0x1000_6451), &plan, || None).expect_err("an F767");
    assert!(matches!(trouble, Trouble::OtherChip { .. }), "{trouble:?}");
}
