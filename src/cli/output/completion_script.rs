//! The completion scripts of shells, which also complete the names of pairs and blocks of the project.

use clap::Command;
use clap_complete::Shell;

use crate::cli::input::name_request::{PAIR_ARGUMENTS, has_block_option, takes_names};

/// Returns the script of a shell.
pub(crate) fn completion_script(shell: Shell, command: &mut Command) -> String {
    let mut script = Vec::new();
    clap_complete::generate(shell, command, "mocban", &mut script);
    let script = String::from_utf8_lossy(&script);
    let script = match shell {
        Shell::Bash => script.replace("complete -F _mocban ", "complete -F _mocban_with_names "),
        Shell::Zsh => with_zsh_names(&script),
        Shell::PowerShell => script.replace(POWERSHELL_START, POWERSHELL_NAMES),
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
        Shell::Fish => format!("{note}\n{script}{}", fish_names(command)),
        Shell::Elvish => format!("{note}\n{script}{ELVISH_NAMES}"),
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

const FISH_NAMES: &str = r"
function __mocban_names
    set -l words (commandline -opc) (commandline -ct)
    $words[1] completions fish -- $words[2..-1] 2>/dev/null
end
";

/// Returns the lines with which fish completes names after the commands that take them.
fn fish_names(command: &Command) -> String {
    let all: Vec<&Command> = command.get_subcommands().collect();
    let names = |has: fn(&Command) -> bool| -> String {
        let with = all.iter().filter(|command| has(command));
        let names = with.flat_map(|command| command.get_name_and_visible_aliases());
        names.collect::<Vec<_>>().join(" ")
    };
    let complete = |commands: String, more: &str| {
        format!(
            "complete -c mocban -n \"__fish_seen_subcommand_from {commands}\" {more}-a \"(__mocban_names)\"\n"
        )
    };
    let pairs = complete(names(takes_names), "");
    let blocks = complete(names(has_block_option), "-l block -r -f ");
    format!("{FISH_NAMES}{pairs}{blocks}")
}

/// The beginning of the function that completes in PowerShell.
const POWERSHELL_START: &str = "    param($wordToComplete, $commandAst, $cursorPosition)\n";
/// The same, which then tries names. An empty word gets quotes, because PowerShell does not pass on empty words.
const POWERSHELL_NAMES: &str = r#"    param($wordToComplete, $commandAst, $cursorPosition)

    $elements = @($commandAst.CommandElements | Where-Object { $_.Extent.StartOffset -lt $cursorPosition })
    $words = @($elements | Select-Object -Skip 1 | ForEach-Object {
        if ($_ -is [StringConstantExpressionAst] -or $_ -is [ExpandableStringExpressionAst]) {
            "'" + $_.Value + "'"
        } else {
            "$_"
        }
    })
    if ($wordToComplete -eq '') {
        $words += "''"
    }
    $encoding = [Console]::OutputEncoding
    try {
        [Console]::OutputEncoding = [System.Text.UTF8Encoding]::new($false)
        $names = @(& $elements[0].Value completions powershell '--' @words 2>$null)
    } catch {
        $names = @()
    } finally {
        [Console]::OutputEncoding = $encoding
    }
    if ($names.Count -gt 0) {
        return $names | ForEach-Object {
            $text = if ($_ -match '^[\w.-]+$') { $_ } else { "'" + ($_ -replace "'", "''") + "'" }
            [CompletionResult]::new($text, $_, [CompletionResultType]::ParameterValue, $_)
        }
    }
"#;

const ELVISH_NAMES: &str = r"
var mocban-arguments~ = $edit:completion:arg-completer[mocban]
set edit:completion:arg-completer[mocban] = {|@words|
    var names = []
    try {
        set names = [((external $words[0]) completions elvish -- (all $words[1..]) 2>&- | from-lines)]
    } catch {
        nop
    }
    if (> (count $names) 0) {
        all $names
    } else {
        mocban-arguments $@words
    }
}
";

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
            (
                Shell::PowerShell,
                "$PROFILE",
                " completions powershell '--' @words",
            ),
            (Shell::Elvish, "lib/mocban.elv", " completions elvish -- "),
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

    #[test]
    fn fish_completes_names_after_every_command_that_takes_them() {
        let fish = completion_script(Shell::Fish, &mut args::command());
        let lines: Vec<&str> = fish
            .lines()
            .filter(|line| line.ends_with("-a \"(__mocban_names)\""))
            .collect();
        let commands = "show view run plan retry retire contact-sheet sheet verdict";
        let [pairs, blocks] = lines.as_slice() else {
            panic!("{lines:?}");
        };
        for name in commands.split(' ') {
            assert!(pairs.contains(&format!(" {name}")), "{name}: {pairs}");
        }
        assert!(
            !pairs.contains(" import") && !pairs.contains(" demo"),
            "{pairs}"
        );
        assert!(
            blocks.contains(" contact-sheet sheet\" -l block "),
            "{blocks}"
        );
    }
}
