//! The simulator on the firmware libraries: estimation, contact models, the native engine.

mod estimation;
mod ladder;
mod native;
mod on_the_fly;
mod scenes_of_strangers;
