//! The completion scripts of shells, which also complete the names of pairs and blocks of the project.

use clap::Command;
use clap_complete::Shell;

use crate::cli::input::name_request::PAIR_ARGUMENTS;

/// Returns the script of a shell.
pub(crate) fn completion_script(shell: Shell, command: &mut Command) -> String {
    let mut script = Vec::new();
    clap_complete::generate(shell, command, "mocban", &mut script);
    let script = String::from_utf8_lossy(&script);
    let script = match shell {
        Shell::Bash => script.replace("complete -F _mocban ", "complete -F _mocban_with_names "),
        Shell::Zsh => with_zsh_names(&script),
        _ => script.into_owned(),
    };
    let place = place(shell);
    let note = place.lines().map(|line| format!("# {line}\n"));
    let note: String = note.collect();
    match shell {
        // zsh reads the name of the command from the first line.
        Shell::Zsh => match script.split_once('\n') {
            Some((first, rest)) => format!("{first}\n{note}\n{ZSH_NAMES}{rest}"),
            None => script,
        },
        Shell::Bash => format!("{note}\n{BASH_NAMES}{script}"),
        Shell::Fish => format!("{note}\n{script}{FISH_NAMES}"),
        _ => format!("{note}\n{script}"),
    }
}

/// Returns where the script of a shell goes, as lines.
const fn place(shell: Shell) -> &'static str {
    match shell {
        Shell::Bash => {
            "Write this script to a file where bash finds it, then open a new terminal:\n  \
             mocban completions bash -o ~/.local/share/bash-completion/completions/mocban\n\
             Without the package bash-completion, add to ~/.bashrc:\n  \
             source <(mocban completions bash)"
        }
        Shell::Zsh => {
            "Write this script to a file where zsh finds it:\n  \
             mocban completions zsh -o ~/.zfunc/_mocban\n\
             Add to ~/.zshrc, then open a new terminal:\n  \
             fpath+=~/.zfunc; autoload -Uz compinit && compinit"
        }
        Shell::Fish => {
            "Write this script to a file where fish finds it, then open a new terminal:\n  \
             mocban completions fish -o ~/.config/fish/completions/mocban.fish"
        }
        Shell::PowerShell => {
            "Add to the file that $PROFILE names, then open a new terminal:\n  \
             mocban completions powershell | Out-String | Invoke-Expression"
        }
        Shell::Elvish => {
            "Write this script to a file, and load it in rc.elv:\n  \
             mocban completions elvish -o ~/.config/elvish/lib/mocban.elv\n  \
             use mocban"
        }
        _ => "Load this script in the shell.",
    }
}

const BASH_NAMES: &str = r#"_mocban_with_names() {
    local name current=${COMP_WORDS[COMP_CWORD]}
    local -a names=()
    while IFS= read -r name; do
        case $current in
            [\'\"]*) names+=("${current:0:1}$name") ;;
            *) names+=("$(printf %q "$name")") ;;
        esac
    done < <("$1" completions bash -- "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null)
    if [ ${#names[@]} -gt 0 ]; then
        COMPREPLY=("${names[@]}")
    else
        _mocban "$@"
    fi
}

"#;

const ZSH_NAMES: &str = r#"_mocban_names() {
    local -a names
    names=("${(@f)$($_mocban_words[1] completions zsh -- "${(@)_mocban_words[2,-1]}" 2>/dev/null)}")
    [[ -n $names[1] ]] && compadd -a names || _files
}
"#;

const FISH_NAMES: &str = r#"
function __mocban_names
    set -l words (commandline -opc) (commandline -ct)
    $words[1] completions fish -- $words[2..-1] 2>/dev/null
end
complete -c mocban -n "__fish_seen_subcommand_from show view run retry retire contact-sheet sheet verdict" -a "(__mocban_names)"
"#;

/// Lets zsh complete names for the arguments that are pairs or blocks, and keeps the whole command line for it.
fn with_zsh_names(script: &str) -> String {
    let is_name = |line: &str| {
        let line = line.trim_start();
        PAIR_ARGUMENTS.iter().any(|name| {
            ["':", "'::", "'*::"]
                .iter()
                .any(|start| line.starts_with(&format!("{start}{name} -- ")))
        }) || line.contains("--block=[Draw")
    };
    let lines = script.lines().map(|line| {
        if line == "_mocban() {" {
            format!("{line}\n    typeset -ga _mocban_words=(\"${{(@)words[1,CURRENT]}}\")\n")
        } else if is_name(line) {
            let line = line.replace(":_default'", ":_mocban_names'");
            format!("{line}\n")
        } else {
            format!("{line}\n")
        }
    });
    lines.collect()
}

#[cfg(test)]
mod tests {
    use clap_complete::Shell;

    use super::completion_script;
    use crate::cli::args;

    #[test]
    fn scripts_say_where_they_go_and_ask_for_names() {
        for (shell, place, names) in [
            (
                Shell::Bash,
                "bash-completion/completions/mocban",
                "-F _mocban_with_names ",
            ),
            (Shell::Zsh, "~/.zfunc/_mocban", ":_mocban_names'"),
            (Shell::Fish, "completions/mocban.fish", "(__mocban_names)"),
        ] {
            let script = completion_script(shell, &mut args::command());
            let head: Vec<&str> = script.lines().take(8).collect();
            let head = head.join("\n");
            assert!(head.contains(place), "{head}");
            assert!(script.contains(names), "{script}");
        }
        let zsh = completion_script(Shell::Zsh, &mut args::command());
        assert!(zsh.starts_with("#compdef mocban\n"), "{zsh}");
        assert!(zsh.matches(":_mocban_names'").count() >= 8, "{zsh}");
    }
}
