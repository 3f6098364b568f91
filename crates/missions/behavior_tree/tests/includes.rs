//! Files that include others.

use std::path::{Path, PathBuf};

use slate_behavior_tree::{BehaviorTree, LeafModels, TreeExecutor, check_tree};

use crate::common::{Answers, step};

/// A folder with these files.
fn folder(name: &str, files: &[(&str, &str)]) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("includes").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(folder.join("parts")).unwrap();
    for (file, content) in files {
        std::fs::write(folder.join(file), format!("<root BTCPP_format=\"4\">\n{content}</root>")).unwrap();
    }
    folder
}

fn read(folder: &Path) -> Result<BehaviorTree, String> {
    BehaviorTree::read(&folder.join("main.xml"), &LeafModels::default()).map_err(|error| error.to_string())
}

const MAIN: &str =
    "<include path=\"parts/drive.xml\"/><BehaviorTree ID=\"main\"><SubTree ID=\"drive\"/></BehaviorTree>";

#[test]
fn a_file_has_the_trees_that_it_includes() {
    let drive = "<include path=\"stop.xml\"/><include path=\"../main.xml\"/>\
                 <BehaviorTree ID=\"drive\">\n<Sequence><Action ID=\"Go\" x=\"{x}\"/><SubTree ID=\"stop\"/></Sequence></BehaviorTree>";
    let stop = "<BehaviorTree ID=\"stop\"><Halt/></BehaviorTree><TreeNodesModel><Action ID=\"Halt\"/></TreeNodesModel>";
    let folder = folder("found", &[("main.xml", MAIN), ("parts/drive.xml", drive), ("parts/stop.xml", stop)]);
    let tree = read(&folder).unwrap();
    assert_eq!(tree.name(), "main");
    let finding = &check_tree(&tree, Some(&|_, id| id != "Halt"))[0];
    assert_eq!((finding.file.clone(), finding.line), (Some(folder.join("parts/stop.xml")), 2));
    let mut executor = TreeExecutor::new(tree.into());
    let mut host = Answers::new(&[("Go", "S"), ("Halt", "S")]);
    assert_eq!(step(&mut executor, &mut host, 0), "start Go, start Halt: Succeeded");
}

#[test]
fn an_included_file_is_named_in_errors() {
    let folder = folder("refused", &[("main.xml", MAIN)]);
    let expect = |words: &str| {
        let error = read(&folder).unwrap_err();
        assert!(error.contains(words), "{error}");
    };
    expect("drive.xml: can't be read");
    let write = |content: &str| std::fs::write(folder.join("parts/drive.xml"), content).unwrap();
    write("<root BTCPP_format=\"4\">\n<BehaviorTree ID=\"drive\"><Nothing/></BehaviorTree></root>");
    expect("drive.xml:2: unknown node `Nothing`");
    write("<root BTCPP_format=\"4\">\n");
    expect("drive.xml:1: expected XML");
    write("<root BTCPP_format=\"4\"><BehaviorTree ID=\"other\"><AlwaysSuccess/></BehaviorTree></root>");
    expect("main.xml:2: unknown sub-tree `drive`");
    let two = "<root BTCPP_format=\"4\"><BehaviorTree ID=\"drive\"><AlwaysSuccess/></BehaviorTree>\
               <BehaviorTree ID=\"drive\"><AlwaysSuccess/></BehaviorTree></root>";
    write(two);
    expect("drive.xml:1: expected another ID, found a second tree `drive`");
    let package = "<root BTCPP_format=\"4\"><include ros_pkg=\"a\" path=\"b.xml\"/></root>";
    std::fs::write(folder.join("main.xml"), package).unwrap();
    expect("main.xml:1: no packages of ROS are known here");
}
