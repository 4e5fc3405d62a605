use crate::*;

fn have_their_fields(checks: &[Value]) {
    for check in checks {
        for field in ["case", "reference", "ours", "criterion", "verdict", "note"] {
            assert!(check[field].is_string(), "{field}: {check}");
        }
        for field in ["error", "bar"] {
            assert!(check[field].is_number() || check[field].is_null());
        }
    }
}

#[test]
fn the_paper_writes_checks_rows_and_charts() {
    let at = folder("paper");
    at.refused("paper fig6", &["fig6", "table1", "claims", "drawings"]);
    let checks = at.json("paper fig4 fig5 --quick --json -");
    let checks = checks.as_array().expect("a list");
    assert!(checks.len() >= 3);
    have_their_fields(checks);
    for name in ["fig4", "fig5"] {
        let file = |end| fs::read_to_string(at.join(format!("target/taut/paper/{name}.{end}")));
        let csv = file("csv").expect("rows");
        assert!(csv.lines().count() > 1000, "{csv}");
        let record: Value = serde_json::from_str(&file("json").expect("checks")).expect("JSON");
        assert_eq!(record["experiment"], name);
        assert!(record["quick"].as_bool().expect("whether quick"));
        let svg = file("svg").expect("a chart");
        assert!(svg.starts_with("<svg") && svg.contains("stretch") | svg.contains("frequency"));
    }
    let table = at.good("paper fig12 --quick --out figures");
    assert!(at.join("figures/fig12.svg").exists());
    assert!(table.contains("Fig. 12: bend") && table.contains("pass"));
    assert!(table.lines().all(|l| l.chars().count() <= 120), "{table}");
    at.write("taken", "");
    let [_, stderr] = at.ends(2, "paper fig4 --quick --out taken/here");
    assert!(stderr.contains("taken/here"));
}

#[test]
fn hard_cases_are_checks_by_name() {
    let at = folder("hard");
    at.refused("hard H99", &["H99", "H30", "H42", "H58"]);
    at.refused("hard H30 H", &["`H`", "H30"]);
    assert!(at.good("hard --keys").contains("[[run.check]]"));
    assert!(at.good("hard H12 --list").contains("2, 4, 8 falls"));
    // What only a step would look up is found before any is made.
    let case = include_str!("../../studies/cases/H12.toml");
    let case = case.replace("drive_speed", "drive_sped");
    at.write("own.toml", case);
    let told = "line 136: no control is called `drive_sped`: perhaps `drive_speed`";
    at.refused("hard own.toml --quick", &["own.toml", told]);
    // A table stands beside the case, not where the program runs.
    fs::create_dir_all(at.join("own")).expect("a folder");
    let case = include_str!("../../studies/cases/outside.toml");
    at.write("own/case.toml", case);
    let _ = fs::remove_file(at.join("own/outside.csv"));
    let row = "hard own/case.toml --quick → line 14: `outside.csv`:  … own/outside.csv";
    at.refuses(row);
    let table = include_str!("../../studies/cases/outside.csv");
    at.write("own/outside.csv", table);
    assert!(
        at.good("hard own/case.toml --list")
            .contains("outside: a chain")
    );
    let checks = at.json("hard h32 H32 H30 --quick --json -");
    let checks = checks.as_array().expect("a list");
    for name in ["H30", "H32"] {
        let own = checks.iter().filter(|check| check["experiment"] == name);
        assert!(own.count() >= 4, "{name}");
    }
    let known = |check: &Value| {
        ["pass", "limit"]
            .map(Value::from)
            .contains(&check["verdict"])
    };
    assert!(checks.iter().all(known), "{checks:?}");
    have_their_fields(checks);
    let table = at.good("hard H42 --quick --json checks.json");
    assert!(table.contains("H42: dependent") && table.contains("limit"));
    assert!(table.lines().all(|l| l.chars().count() <= 120), "{table}");
    assert!(at.join("checks.json").exists());
}
