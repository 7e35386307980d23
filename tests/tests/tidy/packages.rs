//! What is published stands on its own: no file from outside, and what it copies is what it copied. `tests/packages.sh` packs,
//! unpacks and checks them.

use std::{
    fs,
    path::{Path, PathBuf},
};

use crate::{texts, workspace};

/// The folders of the packages that the workspace's table of dependencies gives a version.
fn published() -> Vec<PathBuf> {
    let top = workspace();
    let manifest: toml::Table = toml::from_str(&fs::read_to_string(top.join("Cargo.toml")).unwrap()).unwrap();
    let dependencies = manifest["workspace"]["dependencies"].as_table().unwrap();
    let ours = dependencies.iter().filter(|(name, _)| name.starts_with("impromptu-"));
    let versioned = ours.filter(|(_, dependency)| dependency.get("version").is_some());
    versioned.map(|(_, dependency)| top.join(dependency["path"].as_str().unwrap())).collect()
}

/// The package that a file belongs to: the nearest folder above it with a manifest.
fn package(file: &Path) -> &Path {
    file.ancestors().skip(1).find(|folder| folder.join("Cargo.toml").exists()).unwrap()
}

/// Literal paths of `include_bytes!` and `include_str!`, in code and in documentation.
fn included(text: &str) -> Vec<&str> {
    let calls = ["include_bytes!(\"", "include_str!(\""].into_iter().flat_map(|call| text.split(call).skip(1));
    calls.filter_map(|rest| rest.split('"').next()).collect()
}

#[test]
fn nothing_is_included_from_outside_of_a_package() {
    let published = published();
    assert!(published.len() >= 4);
    let mut seen = 0;
    for folder in &published {
        for (file, text) in texts(folder, &[".rs"]) {
            // Packages within the folder are their own.
            if package(&file) != folder {
                continue;
            }
            for path in included(&text) {
                let target = file.parent().unwrap().join(path);
                let target = target.canonicalize().unwrap_or_else(|error| panic!("{}: {path}: {error}", file.display()));
                assert!(target.starts_with(folder), "{} includes {path}, which is no part of its package", file.display());
                seen += 1;
            }
        }
    }
    assert!(seen > 3, "{seen} files are included");
}

#[test]
fn copies_of_golden_models_are_the_golden_ones() {
    let golden = workspace().join("tests/golden/models");
    for folder in ["firmware/tests/models", "firmware/flight/tests/models"] {
        let copies: Vec<_> = fs::read_dir(workspace().join(folder)).unwrap().map(|entry| entry.unwrap().path()).collect();
        assert!(!copies.is_empty());
        for copy in copies {
            let original = golden.join(copy.file_name().unwrap());
            assert!(fs::read(&copy).unwrap() == fs::read(&original).unwrap(), "copy {} again", original.display());
        }
    }
}

#[test]
fn the_copy_of_the_golden_table_is_the_golden_one() {
    let read = |place: &str| fs::read_to_string(workspace().join(place)).unwrap();
    let (copy, original) = ("host-sim/reproduction/data/mcu.txt", "tests/golden/mcu.txt");
    assert!(read(copy) == read(original), "run: cp {original} {copy}");
}

#[test]
fn manifests_say_what_a_registry_shows() {
    for folder in published() {
        let manifest: toml::Table = toml::from_str(&fs::read_to_string(folder.join("Cargo.toml")).unwrap()).unwrap();
        let package = manifest["package"].as_table().unwrap();
        for key in ["description", "license", "readme", "keywords", "categories", "rust-version"] {
            assert!(package.contains_key(key), "{}: `{key}` is missing", folder.display());
        }
        let crate_name = package["name"].as_str().unwrap();
        let folder_name = folder.file_name().unwrap().to_str().unwrap();
        assert_eq!(crate_name, format!("impromptu-{folder_name}"), "folder and package names correspond");
    }
}
