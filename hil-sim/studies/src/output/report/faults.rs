//! What became of a scene's faults, as a table.

use std::fmt::Write;

use crate::output::escape::escape;
use hil_sim_core::judge::fault::Finding;

/// A line for each fault; nothing if there are none.
pub fn table(findings: &[Finding]) -> String {
    if findings.is_empty() {
        return String::new();
    }
    let ms = |ms: Option<f64>| ms.map_or("–".to_owned(), |ms| format!("{ms:.2} ms"));
    let rows = findings.iter().fold(String::new(), |mut rows, finding| {
        let row = finding.fault.kind.row();
        let _ = writeln!(
            rows,
            "<tr><th scope=row>{}</th><td>{:.3} s</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>\
             <td>{}</td><td>{}</td></tr>",
            row.name,
            finding.fault.at_s,
            row.class.name(),
            ms(finding.detected_ms()),
            escape(&finding.sign),
            ms(finding.safe_ms()),
            if finding.drives_again { "yes" } else { "no" },
            match &finding.unmet()[..] {
                [] => String::new(),
                unmet => format!("<span class=unmet>{}</span>", escape(&unmet.join("; "))),
            },
        );
        rows
    });
    format!(
        "<div class=wide><table><caption>Faults</caption><thead><tr><th>kind</th><th>at</th>\
         <th>expected</th><th>first sign after</th><th>sign</th><th>0 V after</th><th>drives again</th>\
         <th></th></tr></thead><tbody>\n{rows}</tbody></table></div>\n"
    )
}
