//! The whole system, in one program: both ELFs on emulated boards, `host-bridge` beside them, files, documents.

mod bench;
mod bridge_bringup;
mod bridge_configure;
mod bridge_doctor;
mod bridge_doctor_boards;
mod bridge_export;
mod bridge_flash;
mod bridge_link;
mod bridge_link_terminal;
mod bridge_live;
mod bridge_monitor;
mod bridge_monitor_boards;
mod bridge_record;
mod bridge_relay;
mod bridge_relay_boards;
mod bridge_relay_processes;
mod bridge_relay_refusals;
mod bridge_replay;
mod docs;
mod elves;
mod identity;
mod layers;
mod recording;
