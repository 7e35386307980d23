//! Builds C programs against the library of the C face, for this machine and for the emulated one.
//!
//! Nothing here skips: without a compiler a test fails, with the line that installs what is missing.

use std::{
    fs::{self, File},
    io::{self, ErrorKind, Write},
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
    time::Duration,
};

use anyhow::{Context, Result, anyhow, ensure};
use wait_timeout::ChildExt;

use crate::emulator::{self, TARGET, require_target, target_folder, tool, workspace};

/// What every C compiler must accept without a word.
pub const STRICT: [&str; 5] = ["-Wall", "-Wextra", "-Werror", "-pedantic", "-O2"];

/// What finds wrong uses of memory, and what C does not define; the first one ends the program.
const SANITIZED: [&str; 3] = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer"];

/// The core of the STM32F405, as the Crazyflie's firmware names it too.
const CORE: [&str; 4] = ["-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"];

/// Where a program runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Machine {
    /// Here.
    Host,
    /// On the emulated board.
    Board,
}

impl Machine {
    /// Its C compiler, with what that needs to know of the machine.
    pub fn compiler(self) -> Command {
        match self {
            Self::Host => Command::new("cc"),
            Self::Board => {
                let mut compiler = Command::new("arm-none-eabi-gcc");
                compiler.args(CORE).args(["-ffunction-sections", "-fdata-sections"]);
                compiler
            }
        }
    }

    /// Its name, as rustc's; `None` is this machine.
    pub fn target(self) -> Option<&'static str> {
        match self {
            Self::Host => None,
            Self::Board => Some(TARGET),
        }
    }

    /// Makes the library as it is shipped, by the documented command.
    pub fn library(self) -> Result<PathBuf> {
        if self == Self::Board {
            require_target()?;
        }
        library(self.target(), None)
    }

    /// Compiles and links `sources` (below `tests/c`) with the library to `folder/program`.
    pub fn program(self, folder: &Path, flags: &[&str], sources: &[&str]) -> Result<PathBuf> {
        let library = self.library()?;
        let program = folder.join("program");
        let mut compiler = self.compiler();
        compiler.arg("-std=c99").args(STRICT).args(flags).arg("-I").arg(include());
        compiler.args(sources.iter().map(|source| programs().join(source)));
        match self {
            Self::Host => compiler.arg(library).args(["-lpthread", "-ldl", "-lm"]),
            Self::Board => {
                compiler.arg(programs().join("start.c")).arg(library).arg("-T").arg(programs().join("stm32f405.ld"));
                // Newlib's start-up files say nothing of the stack, which the linker would remark upon.
                compiler.args(["--specs=rdimon.specs", "-Wl,--gc-sections", "-Wl,-z,noexecstack"])
            }
        };
        finished(compiler.arg("-o").arg(&program))?;
        Ok(program)
    }

    /// Runs a program in `folder` for at most `timeout`; gives its standard output.
    pub fn run(self, program: &Path, folder: &Path, timeout: Duration) -> Result<String> {
        if self == Self::Board {
            let output = emulator::run(program, folder, timeout)?;
            ensure!(output.status.success(), "the program failed ({}):\n{}{}", output.status, output.stdout, output.stderr);
            return Ok(output.stdout);
        }
        let mut child = Command::new(program).current_dir(folder).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn()?;
        if child.wait_timeout(timeout)?.is_none() {
            child.kill()?;
        }
        let output = child.wait_with_output()?;
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        ensure!(output.status.success(), "the program failed ({}):\n{}", output.status, text(&output.stderr));
        Ok(text(&output.stdout))
    }
}

/// Runs `library.sh` for a target, or this machine; gives the path of what it made: of the library, if no place is named.
pub fn library(target: Option<&str>, place: Option<&Path>) -> Result<PathBuf> {
    let folder = target_folder();
    fs::create_dir_all(&folder).with_context(|| format!("cannot create {}", folder.display()))?;
    let lock = File::create(folder.join("emulator.lock"))?;
    lock.lock()?;
    let mut script = Command::new(crate_folder().join("library.sh"));
    for (variable, value) in tool("cargo").get_envs() {
        match value {
            Some(value) => script.env(variable, value),
            None => script.env_remove(variable),
        };
    }
    let output = finished(script.arg(target.unwrap_or_default()).args(place).env("CARGO_TARGET_DIR", &folder))?;
    Ok(PathBuf::from(String::from_utf8(output.stdout)?.trim_end()))
}

/// The flags with which a program of this machine watches its memory, found out with a small one in `folder`. Without them the
/// compiler is none that is missing: that is said, also by a test that passes.
pub fn sanitizers(folder: &Path) -> Option<&'static [&'static str]> {
    let (source, program) = (folder.join("small.c"), folder.join("small"));
    let run = || -> Result<()> {
        fs::write(&source, "int main(void);\nint main(void) { return 0; }\n")?;
        finished(Machine::Host.compiler().args(SANITIZED).arg(&source).arg("-o").arg(&program))?;
        finished(&mut Command::new(&program)).map(drop)
    };
    let Err(error) = run() else { return Some(&SANITIZED) };
    // Not a macro's print, which is shown of failed tests alone.
    let said = writeln!(io::stderr(), "C programs are NOT run under sanitizers here, which the compiler lacks: {error:#}");
    assert!(said.is_ok());
    None
}

/// Runs a compiler or linker to its end.
///
/// # Errors
/// With what it says, or with how to install it.
pub fn finished(command: &mut Command) -> Result<Output> {
    let name = command.get_program().to_string_lossy().into_owned();
    let output = command.output().map_err(|error| match error.kind() {
        ErrorKind::NotFound => missing(&name),
        _ => anyhow!(error).context(format!("cannot start {name}")),
    })?;
    ensure!(output.status.success(), "{name} failed:\n{}", String::from_utf8_lossy(&output.stderr));
    Ok(output)
}

/// The error for a machine without a compiler.
fn missing(name: &str) -> anyhow::Error {
    let packages = match name {
        "c++" => "g++ libc6-dev",
        name if name.starts_with("arm-none-eabi") => "gcc-arm-none-eabi libnewlib-arm-none-eabi",
        _ => "gcc libc6-dev",
    };
    anyhow!("{name} is not installed; run: sudo apt-get install {packages}")
}

/// The folder of the header.
pub fn include() -> PathBuf {
    crate_folder().join("include")
}

/// The folder of the C face.
pub fn crate_folder() -> PathBuf {
    workspace().join("firmware/c-abi")
}

/// The folder of the C programs.
pub fn programs() -> PathBuf {
    workspace().join("tests/c")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_compiler_is_named_with_the_line_that_installs_it() {
        let error = finished(&mut Command::new("arm-none-eabi-no-such-compiler")).unwrap_err().to_string();
        assert!(error.contains("run: sudo apt-get install gcc-arm-none-eabi libnewlib-arm-none-eabi"), "{error}");
    }
}
