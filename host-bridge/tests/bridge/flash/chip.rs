//! A probe with a model of an STM32F429 behind it: as much of the debug port, the core and the flash as
//! probe-rs needs to program one.
//!
//! probe-rs's own `FakeProbe` reaches as far as an attached session whose memory reads as a file; it has no
//! core registers, no RAM that keeps what is written, and its reset does not end, so that its flashing stops
//! before the first erase. Here the routines that probe-rs downloads are not executed: what they would do is
//! done when the core is set running at their entries.

use std::collections::{BTreeSet, HashMap};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use probe_rs::architecture::arm::ap::CSW;
use probe_rs::architecture::arm::dp::{DpAddress, DpRegisterAddress};
use probe_rs::architecture::arm::memory::ArmMemoryInterface;
use probe_rs::architecture::arm::sequences::ArmDebugSequence;
use probe_rs::architecture::arm::{
    ArmDebugInterface, ArmError, DapAccess, DapProbe, FullyQualifiedApAddress, SwdSequence,
    SwoAccess, SwoConfig,
};
use probe_rs::flashing::FlashAlgorithm;
use probe_rs::probe::{DebugProbe, DebugProbeError, Probe, WireProtocol};
use probe_rs::{Error, MemoryInterface, Target};

const FLASH: u64 = 0x0800_0000;
const FLASH_BYTES: usize = 2 * 1024 * 1024;
const RAM: u64 = 0x2000_0000;
const RAM_BYTES: usize = 192 * 1024;

const AIRCR: u64 = 0xE000_ED0C;
const DFSR: u64 = 0xE000_ED30;
const DHCSR: u64 = 0xE000_EDF0;
const DCRSR: u64 = 0xE000_EDF4;
const DCRDR: u64 = 0xE000_EDF8;
const DEMCR: u64 = 0xE000_EDFC;
/// DBGMCU_IDCODE.
pub const DEVICE_ID: u64 = 0xE004_2000;
/// The word that ends with the flash's size in KiB.
pub const FLASH_SIZE: u64 = 0x1FFF_7A20;
/// FLASH_OPTCR.
pub const OPTIONS: u64 = 0x4002_3C14;
/// FLASH_OPTCR1.
pub const OPTIONS_1: u64 = 0x4002_3C18;

const PC: usize = 15;
const XPSR: usize = 16;
const THUMB: u32 = 1 << 24;

/// What has been done to the chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Deed {
    /// A sector was erased, by its address.
    Erased(u64),
    /// A page was written, by its address.
    Written(u64),
    /// It was reset.
    Reset,
}

/// The chip.
pub struct Chip {
    /// Its flash.
    pub flash: Vec<u8>,
    /// What was done to it.
    pub deeds: Vec<Deed>,
    /// Whether its core runs.
    pub is_running: bool,
    /// A bit of the flash that can't be written to 0, by its offset.
    pub broken_byte: Option<usize>,
    /// A sector that can't be erased, by its address.
    pub stubborn_sector: Option<u64>,
    /// The supply, as the probe measures it.
    pub volts: f32,
    /// Whether it answers.
    pub is_there: bool,
    ram: Vec<u8>,
    words: HashMap<u64, u32>,
    registers: [u32; 128],
    /// Not read since the last reset.
    was_reset: bool,
    algorithm: FlashAlgorithm,
}

impl Chip {
    /// A chip with something in its flash, running it.
    pub fn new(target: &Target) -> Arc<Mutex<Self>> {
        let raw = target
            .flash_algorithms
            .iter()
            .find(|raw| raw.flash_properties.address_range.contains(&FLASH))
            .expect("probe-rs can flash the chip");
        let core = &target.default_core().name;
        let algorithm = FlashAlgorithm::assemble_from_raw_with_core(raw, core, target)
            .expect("its routines fit the RAM");
        Arc::new(Mutex::new(Self {
            flash: vec![0x5A; FLASH_BYTES],
            deeds: Vec::new(),
            is_running: true,
            broken_byte: None,
            stubborn_sector: None,
            volts: 3.3,
            is_there: true,
            ram: vec![0; RAM_BYTES],
            words: HashMap::from([
                (DEVICE_ID, 0x2003_6419),
                (FLASH_SIZE, 2048 << 16),
                (OPTIONS, 0x0FFF_AAED),
                (OPTIONS_1, 0x0FFF_0000),
            ]),
            registers: [0; 128],
            was_reset: false,
            algorithm,
        }))
    }

    /// Has `address` read as `word`.
    pub fn set_word(&mut self, address: u64, word: u32) {
        self.words.insert(address, word);
    }

    fn read(&mut self, address: u64) -> u32 {
        let memory = |bytes: &[u8], offset: u64| {
            let offset = offset as usize;
            bytes
                .get(offset..offset + 4)
                .and_then(|bytes| bytes.try_into().ok())
                .map_or(0, u32::from_le_bytes)
        };
        match address {
            DHCSR => {
                let control = self.words.get(&DHCSR).copied().unwrap_or(0) & 0xFFFD;
                let reset = u32::from(std::mem::take(&mut self.was_reset)) << 25;
                // A core that halts of itself asks itself to.
                let halted = u32::from(!self.is_running);
                control | halted << 1 | 1 << 16 | halted << 17 | reset
            }
            FLASH..0x0820_0000 => memory(&self.flash, address - FLASH),
            RAM..0x2003_0000 => memory(&self.ram, address - RAM),
            _ => self.words.get(&address).copied().unwrap_or(0),
        }
    }

    fn write(&mut self, address: u64, word: u32) {
        match address {
            DHCSR if word >> 16 == 0xA05F => {
                let (halt, step) = (word & 2 != 0, word & 4 != 0);
                self.words.insert(DHCSR, word & 0xFFFF);
                match (halt, step, self.is_running) {
                    (true, _, _) => self.is_running = false,
                    // A step is no more than a halt: no instruction is executed here.
                    (false, true, _) => {
                        self.is_running = false;
                        self.words.insert(DFSR, 1);
                    }
                    (false, false, false) => self.run(),
                    (false, false, true) => {}
                }
            }
            AIRCR if word & 4 != 0 => {
                self.deeds.push(Deed::Reset);
                self.was_reset = true;
                self.registers = [0; 128];
                self.registers[XPSR] = THUMB;
                let catch = self.words.get(&DEMCR).copied().unwrap_or(0) & 1 != 0;
                self.is_running = !catch;
                if catch {
                    self.words.insert(DFSR, 1 << 3);
                }
            }
            DCRSR => {
                let register = (word & 0x7F) as usize;
                if word & 1 << 16 == 0 {
                    self.words.insert(DCRDR, self.registers[register]);
                } else {
                    self.registers[register] = self.words.get(&DCRDR).copied().unwrap_or(0);
                }
            }
            // Its bits are cleared by ones.
            DFSR => {
                self.words.insert(DFSR, 0);
            }
            RAM..0x2003_0000 => {
                let offset = (address - RAM) as usize;
                self.ram[offset..offset + 4].copy_from_slice(&word.to_le_bytes());
            }
            FLASH..0x0820_0000 => panic!("the flash can't be written like this"),
            _ => {
                self.words.insert(address, word);
            }
        }
    }

    /// Goes on from the program counter: through one of probe-rs's routines, or for good.
    fn run(&mut self) {
        let entry = u64::from(self.registers[PC]) | 1;
        let algorithm = &self.algorithm;
        let result = if Some(entry) == algorithm.pc_init || Some(entry) == algorithm.pc_uninit {
            0
        } else if entry == algorithm.pc_erase_sector {
            self.erase(u64::from(self.registers[0]))
        } else if entry == algorithm.pc_program_page {
            let [address, bytes, from] = [0, 1, 2].map(|at| u64::from(self.registers[at]));
            self.program(address, bytes as usize, from)
        } else {
            self.is_running = true;
            return;
        };
        self.registers[0] = result;
        // The breakpoint that the routine returns to.
        self.registers[PC] = self.algorithm.load_address as u32;
        self.words.insert(DFSR, 1);
    }

    fn erase(&mut self, address: u64) -> u32 {
        if self.stubborn_sector == Some(address) {
            return 1;
        }
        let sector = self.algorithm.sector_info(address).expect("a sector");
        assert_eq!(sector.base_address, address, "sectors are erased whole");
        let start = (address - FLASH) as usize;
        self.flash[start..start + sector.size as usize].fill(0xFF);
        self.deeds.push(Deed::Erased(address));
        0
    }

    fn program(&mut self, address: u64, bytes: usize, from: u64) -> u32 {
        let (to, from) = ((address - FLASH) as usize, (from - RAM) as usize);
        for at in 0..bytes {
            // Flash only goes from 1 to 0.
            self.flash[to + at] &= self.ram[from + at];
            if self.broken_byte == Some(to + at) {
                self.flash[to + at] |= 1;
            }
        }
        self.deeds.push(Deed::Written(address));
        0
    }
}

/// A probe with the chip behind it.
pub fn probe(chip: &Arc<Mutex<Chip>>) -> Probe {
    Probe::new(Wire(Arc::clone(chip)))
}

/// Every layer between probe-rs and the chip.
struct Wire(Arc<Mutex<Chip>>);

impl Wire {
    fn chip(&self) -> Result<MutexGuard<'_, Chip>, ArmError> {
        let chip = self
            .0
            .lock()
            .expect("no test panics while it holds the chip");
        if chip.is_there {
            Ok(chip)
        } else {
            Err(ArmError::Timeout)
        }
    }
}

impl std::fmt::Debug for Wire {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Wire")
    }
}

impl DebugProbe for Wire {
    fn get_name(&self) -> &str {
        "a probe in a test"
    }

    fn speed_khz(&self) -> u32 {
        1_800
    }

    fn set_speed(&mut self, speed_khz: u32) -> Result<u32, DebugProbeError> {
        Ok(speed_khz)
    }

    fn attach(&mut self) -> Result<(), DebugProbeError> {
        if self.0.lock().expect("the chip").is_there {
            Ok(())
        } else {
            Err(DebugProbeError::TargetNotFound)
        }
    }

    fn detach(&mut self) -> Result<(), Error> {
        Ok(())
    }

    fn target_reset(&mut self) -> Result<(), DebugProbeError> {
        Ok(())
    }

    fn target_reset_assert(&mut self) -> Result<(), DebugProbeError> {
        Ok(())
    }

    fn target_reset_deassert(&mut self) -> Result<(), DebugProbeError> {
        Ok(())
    }

    fn select_protocol(&mut self, _: WireProtocol) -> Result<(), DebugProbeError> {
        Ok(())
    }

    fn active_protocol(&self) -> Option<WireProtocol> {
        Some(WireProtocol::Swd)
    }

    fn has_arm_interface(&self) -> bool {
        true
    }

    fn try_get_arm_debug_interface<'probe>(
        self: Box<Self>,
        _: Arc<dyn ArmDebugSequence>,
    ) -> Result<Box<dyn ArmDebugInterface + 'probe>, (Box<dyn DebugProbe>, ArmError)> {
        Ok(self)
    }

    fn into_probe(self: Box<Self>) -> Box<dyn DebugProbe> {
        self
    }

    fn get_target_voltage(&mut self) -> Result<Option<f32>, DebugProbeError> {
        Ok(Some(self.0.lock().expect("the chip").volts))
    }
}

impl ArmDebugInterface for Wire {
    fn reinitialize(&mut self) -> Result<(), ArmError> {
        Ok(())
    }

    fn access_ports(
        &mut self,
        dp: DpAddress,
    ) -> Result<BTreeSet<FullyQualifiedApAddress>, ArmError> {
        Ok(BTreeSet::from([FullyQualifiedApAddress::v1_with_dp(dp, 0)]))
    }

    fn close(self: Box<Self>) -> Probe {
        Probe::from_specific_probe(self)
    }

    fn select_debug_port(&mut self, _: DpAddress) -> Result<(), ArmError> {
        Ok(())
    }

    fn current_debug_port(&self) -> Option<DpAddress> {
        Some(DpAddress::Default)
    }

    fn memory_interface(
        &mut self,
        _: &FullyQualifiedApAddress,
    ) -> Result<Box<dyn ArmMemoryInterface + '_>, ArmError> {
        Ok(Box::new(Self(Arc::clone(&self.0))))
    }
}

impl ArmMemoryInterface for Wire {
    fn fully_qualified_address(&self) -> FullyQualifiedApAddress {
        FullyQualifiedApAddress::v1_with_default_dp(0)
    }

    fn base_address(&mut self) -> Result<u64, ArmError> {
        Ok(0xE00F_F003)
    }

    fn get_arm_debug_interface(&mut self) -> Result<&mut dyn ArmDebugInterface, DebugProbeError> {
        Ok(self)
    }

    fn generic_status(&mut self) -> Result<CSW, ArmError> {
        Err(ArmError::NotImplemented("status"))
    }
}

impl MemoryInterface<ArmError> for Wire {
    fn supports_native_64bit_access(&mut self) -> bool {
        false
    }

    fn read_64(&mut self, _: u64, _: &mut [u64]) -> Result<(), ArmError> {
        Err(ArmError::NotImplemented("64 bits"))
    }

    fn read_32(&mut self, address: u64, data: &mut [u32]) -> Result<(), ArmError> {
        let mut chip = self.chip()?;
        for (address, word) in (address..).step_by(4).zip(data) {
            *word = chip.read(address);
        }
        Ok(())
    }

    fn read_16(&mut self, _: u64, _: &mut [u16]) -> Result<(), ArmError> {
        Err(ArmError::NotImplemented("16 bits"))
    }

    fn read_8(&mut self, address: u64, data: &mut [u8]) -> Result<(), ArmError> {
        let mut chip = self.chip()?;
        for (address, byte) in (address..).zip(data) {
            *byte = chip.read(address & !3).to_le_bytes()[(address & 3) as usize];
        }
        Ok(())
    }

    fn write_64(&mut self, _: u64, _: &[u64]) -> Result<(), ArmError> {
        Err(ArmError::NotImplemented("64 bits"))
    }

    fn write_32(&mut self, address: u64, data: &[u32]) -> Result<(), ArmError> {
        let mut chip = self.chip()?;
        for (address, word) in (address..).step_by(4).zip(data) {
            chip.write(address, *word);
        }
        Ok(())
    }

    fn write_16(&mut self, _: u64, _: &[u16]) -> Result<(), ArmError> {
        Err(ArmError::NotImplemented("16 bits"))
    }

    fn write_8(&mut self, _: u64, _: &[u8]) -> Result<(), ArmError> {
        Err(ArmError::NotImplemented("8 bits"))
    }

    fn supports_8bit_transfers(&self) -> Result<bool, ArmError> {
        Ok(false)
    }

    fn flush(&mut self) -> Result<(), ArmError> {
        Ok(())
    }
}

impl DapAccess for Wire {
    fn read_raw_dp_register(
        &mut self,
        _: DpAddress,
        _: DpRegisterAddress,
    ) -> Result<u32, ArmError> {
        Ok(0)
    }

    fn write_raw_dp_register(
        &mut self,
        _: DpAddress,
        _: DpRegisterAddress,
        _: u32,
    ) -> Result<(), ArmError> {
        Ok(())
    }

    fn read_raw_ap_register(
        &mut self,
        _: &FullyQualifiedApAddress,
        _: u64,
    ) -> Result<u32, ArmError> {
        Ok(0)
    }

    fn write_raw_ap_register(
        &mut self,
        _: &FullyQualifiedApAddress,
        _: u64,
        _: u32,
    ) -> Result<(), ArmError> {
        Ok(())
    }

    fn try_dap_probe(&self) -> Option<&dyn DapProbe> {
        None
    }

    fn try_dap_probe_mut(&mut self) -> Option<&mut dyn DapProbe> {
        None
    }
}

impl SwdSequence for Wire {
    fn swj_sequence(&mut self, _: u8, _: u64) -> Result<(), DebugProbeError> {
        Ok(())
    }

    fn swj_pins(&mut self, _: u32, _: u32, _: u32) -> Result<u32, DebugProbeError> {
        Ok(0)
    }
}

impl SwoAccess for Wire {
    fn enable_swo(&mut self, _: &SwoConfig) -> Result<(), ArmError> {
        Err(ArmError::NotImplemented("SWO"))
    }

    fn disable_swo(&mut self) -> Result<(), ArmError> {
        Err(ArmError::NotImplemented("SWO"))
    }

    fn read_swo_timeout(&mut self, _: Duration) -> Result<Vec<u8>, ArmError> {
        Err(ArmError::NotImplemented("SWO"))
    }
}
