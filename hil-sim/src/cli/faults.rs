//! `hil-sim faults`.

use std::process::ExitCode;

use super::say::say;
use hil_sim_core::scene::fault::Shows;
use hil_sim_core::scene::fault::catalogue::{Lasts, Needs, Row, rows};

pub(super) fn execute() -> ExitCode {
    let list: Vec<String> = rows().iter().map(entry).collect();
    say!("{}", list.join("\n"));
    ExitCode::SUCCESS
}

/// From when on it shows, in words.
const fn when(shows: Shows) -> &'static str {
    match shows {
        Shows::Meanwhile => "",
        Shows::WhenOver => ", later where it lasts longer than usual",
        Shows::WhileDriving => " while the display drives",
    }
}

fn entry(row: &Row) -> String {
    let lasts = match row.lasts {
        Lasts::Once => "happens once; no for_s".to_owned(),
        Lasts::For(s) => format!("for_s = {s} unless given"),
        Lasts::ForGood => "to the end unless for_s is given".to_owned(),
    };
    let keys = row.keys.iter().map(|key| {
        format!(
            "    {:<9} {} (default {})\n",
            key.name, key.meaning, key.default
        )
    });
    let engine = match row.needs {
        Needs::Nothing => "native, elf",
        Needs::Boards => "elf",
    };
    let sign = match (row.signs, row.seen_within_ms) {
        ([], _) => "no sign of it".to_owned(),
        (_, Some(ms)) => format!("seen within {ms} ms{}", when(row.shows)),
        (_, None) => "seen when what arrives is a reason to hold".to_owned(),
    };
    let safe = match row.safe_within_ms {
        None => "can't put out a wrong voltage".to_owned(),
        Some(ms) => format!("all outputs at 0 V within {ms} ms"),
    };
    let resets = match row.resets {
        0 => "no reset of the display",
        _ => "one reset of the display at most",
    };
    let anew = match row.forgets {
        true => " and of three waves felt anew",
        false => "",
    };
    let again = match (row.class.may_drive_again(), row.again_within_ms) {
        (false, _) => "never drives again until its power goes".to_owned(),
        (true, Some(ms)) if row.kind.is_of_arm() => format!(
            "an arm that its drive moves rests for good; one that the scene moves: drives again within {ms} ms of its end{anew}"
        ),
        (true, Some(ms)) => format!("drives again within {ms} ms of its end{anew}"),
        (true, None) => "drives on".to_owned(),
    };
    format!(
        "{}: {}\n    done      {}\n    lasts     {lasts}\n{}    engine    {engine}\n    expected  {}\n    \
         judged    {}: {sign}; {safe}; {again}; {resets}\n",
        row.name,
        row.meaning,
        row.injected,
        keys.collect::<String>(),
        row.expected,
        row.class.name()
    )
}
