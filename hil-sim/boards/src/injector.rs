//! Breaks an emulated board at the instants that a scene gives, to the instruction.

use std::collections::BTreeSet;

use protocol::{DisplayConfiguration, Role};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rigless::emulator::{Host, Stop};
use rigless::session::Session;
use rigless::soc::Width;
use rigless::soc::stm32f427::generated::{ADC3, RCC, TIM3};

use super::nucleo::{Nucleo, Pins};
use super::traps::{Trap, Traps};
use hil_sim_core::plant::fault::clock::Clock;
use hil_sim_core::scene::Scene;
use hil_sim_core::scene::fault::catalogue::Needs;
use hil_sim_core::scene::fault::{Class, Fault, Kind};

/// RAM that loses what it holds without power: SRAM and CCM (RM0090, 2.3).
const RAM: [(u64, u64); 2] = [(0x2000_0000, 192 << 10), (0x1000_0000, 64 << 10)];
const RCC_AHB1ENR: u64 = 0x30;
const RCC_APB2ENR: u64 = 0x44;
const DMA1EN: u64 = 1 << 21;
const DMA2EN: u64 = 1 << 22;
const SPI1EN: u64 = 1 << 12;
const CR1: u64 = 0x00;
const CEN: u64 = 1;
const ADC_CR2: u64 = 0x08;
const ADON: u64 = 1;

/// Parts of the names of what is broken.
const OUTPUT_TASK: &str = "tasks5drive4POOL";
const SAMPLING_TASK: &str = "tasks6sample4POOL";
const THREAD_TASK: &str = "ports6report4POOL";

/// What breaks one board, and when.
pub struct Injector {
    role: Role,
    /// Instants of the scene's clock, in order; whether it begins then.
    steps: Vec<(u64, Fault, bool)>,
    next: usize,
    clock: Clock,
    traps: Option<Traps>,
    settings: DisplayConfiguration,
    draws: Xoshiro256PlusPlus,
    /// When power was cut, by the board's clock.
    pub cuts_ns: BTreeSet<u64>,
    /// The first fault that could not be done.
    pub failed: Option<Kind>,
    /// Whether power is off.
    pub is_off: bool,
}

impl Injector {
    /// What `scene` does to the board of `role`, which runs `elf` by `clock`.
    pub fn new(scene: &Scene, role: Role, elf: &[u8], clock: Clock) -> Self {
        let mut steps = Vec::new();
        for fault in scene
            .faults
            .iter()
            .filter(|fault| fault.cuts_power(role) || breaks(fault.kind, role))
        {
            steps.push((fault.begins_ns(), *fault, true));
            steps.extend(fault.ends_ns().map(|at_ns| (at_ns, *fault, false)));
        }
        steps.sort_by_key(|&(at_ns, _, begins)| (at_ns, begins));
        Self {
            role,
            traps: (!steps.is_empty()).then(|| Traps::find(elf)).flatten(),
            steps,
            next: 0,
            clock,
            settings: scene.display_configuration(),
            draws: Xoshiro256PlusPlus::seed_from_u64(scene.seed ^ 0xFA17),
            cuts_ns: BTreeSet::new(),
            failed: None,
            is_off: false,
        }
    }

    /// The traps, if the board may run into one.
    pub fn traps(&self) -> Option<&Traps> {
        self.traps.as_ref()
    }

    /// Whether it has anything to do.
    pub fn breaks(&self) -> bool {
        !self.steps.is_empty()
    }

    /// When it has something to do next, by the board's clock.
    pub fn next_ns(&self) -> Option<u64> {
        let &(at_ns, ..) = self.steps.get(self.next)?;
        Some(self.clock.local_ns(at_ns))
    }

    /// Does what is due; true if power has been cut.
    pub fn act<P: Pins>(
        &mut self,
        session: &mut Session<Nucleo<P>>,
        stop: Stop,
        host: &mut dyn Host,
    ) -> bool {
        let mut is_cut = false;
        while self.next_ns().is_some_and(|at_ns| at_ns <= stop.at.0) {
            let (_, fault, begins) = self.steps[self.next];
            self.next += 1;
            if fault.cuts_power(self.role) {
                is_cut |= begins;
                self.power(session, stop, host, begins);
            }
            let (pins, part) = session.board_mut().pins();
            pins.break_by(part, &fault, begins, stop.at.0);
            if !self.injure(session, stop, host, &fault, begins) {
                self.failed.get_or_insert(fault.kind);
            }
        }
        is_cut
    }

    fn power<P: Pins>(
        &mut self,
        session: &mut Session<Nucleo<P>>,
        stop: Stop,
        host: &mut dyn Host,
        cut: bool,
    ) {
        self.is_off = cut;
        if cut {
            self.cuts_ns.insert(stop.at.0);
            session.board_mut().lose_power();
            session.reset_by_pin(stop.at, stop.instruction_count, host);
            for (base, size) in RAM {
                for address in (base..base + size).step_by(4) {
                    let word = self.draws.next_u32();
                    let _ = host.write(address, Width::W32, word.into());
                }
            }
        }
        host.hold(cut);
    }

    /// What is done to the processor; false if it can't be.
    fn injure<P: Pins>(
        &mut self,
        session: &mut Session<Nucleo<P>>,
        stop: Stop,
        host: &mut dyn Host,
        fault: &Fault,
        begins: bool,
    ) -> bool {
        let board = session.board_mut();
        let mut gate = |address: u64, bit: u64| board.set_bits(stop.at, address, bit, !begins);
        match fault.kind {
            Kind::TickStopped => gate(TIM3.base + CR1, CEN),
            Kind::SpiStall => gate(RCC.base + RCC_APB2ENR, SPI1EN),
            Kind::DmaStall => gate(RCC.base + RCC_AHB1ENR, DMA2EN),
            Kind::UartOverrun => {
                let is_gated = gate(RCC.base + RCC_AHB1ENR, DMA1EN);
                board.deafen(begins);
                is_gated
            }
            Kind::AdcStopped => gate(ADC3.base + ADC_CR2, ADON),
            Kind::WireStuckLow => {
                board.break_line(begins);
                true
            }
            Kind::OutputTaskStall => self.lead(OUTPUT_TASK, Trap::Loop, host),
            Kind::ThreadStall => self.lead(THREAD_TASK, Trap::Loop, host),
            Kind::BoardHang => self.lead(OUTPUT_TASK, Trap::Hang, host),
            Kind::Panic => self.lead(OUTPUT_TASK, Trap::Panic, host),
            Kind::HardFault => self.lead(OUTPUT_TASK, Trap::Undefined, host),
            Kind::StackOverflow => self.lead(OUTPUT_TASK, Trap::Recursion, host),
            Kind::SensorHang => self.lead(SAMPLING_TASK, Trap::Hang, host),
            Kind::SensorPanic => self.lead(SAMPLING_TASK, Trap::Panic, host),
            Kind::MemoryChanged => self.turn_bit(fault, host),
            _ => true,
        }
    }

    /// False if the ELF does not show where the task is.
    fn lead(&self, task: &str, trap: Trap, host: &mut dyn Host) -> bool {
        self.traps
            .as_ref()
            .is_some_and(|traps| traps.lead(task, trap, host) || self.was_broken())
    }

    /// Whether it was broken before the fault that is due: it may have no power, be starting, or have been led astray.
    const fn was_broken(&self) -> bool {
        self.next > 1
    }

    /// Turns a bit of a setting where the output task holds them: their 16-bit numbers lie in the order of
    /// their declaration. Copies that the task's start has left, which nothing reads, are turned with them.
    /// False if the ELF does not show where.
    fn turn_bit(&self, fault: &Fault, host: &mut dyn Host) -> bool {
        let Some(traps) = &self.traps else {
            return false;
        };
        let set = &self.settings;
        let numbers = [
            set.max_age_ms,
            set.fade_in_ms,
            set.fade_out_ms,
            set.glide_ms,
            set.amplitude_mv,
            set.reference_lsb,
            set.reference_mn,
            set.full_drive_s,
        ];
        let pattern: Vec<u8> = numbers.into_iter().flat_map(u16::to_le_bytes).collect();
        let places = traps.places(&[OUTPUT_TASK], &pattern, host);
        let [setting, bit] = fault.values.map(|value| value as u64);
        let turn = |place: &u64, host: &mut dyn Host| {
            let address = place + 2 * setting;
            host.read(address, Width::W16)
                .and_then(|word| host.write(address, Width::W16, word ^ 1 << bit))
                .is_ok()
        };
        (!places.is_empty() || self.was_broken()) && places.iter().all(|place| turn(place, host))
    }
}

/// Whether a kind breaks the board of `role`: each that needs boards does, but for what a host does on the console, and
/// the wire that ends there.
fn breaks(kind: Kind, role: Role) -> bool {
    let row = kind.row();
    let is_on_board = row.needs == Needs::Boards && !kind.is_of_host();
    let is_sensors = row.class == Class::Sensor;
    (is_on_board || kind == Kind::WireStuckLow) && is_sensors == (role == Role::Sensor)
}
