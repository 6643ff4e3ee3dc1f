//! System tests of Ridgelink live in the `tests` folder of this package.
