//! `config show`: prints the settings in effect as a settings file.

use clap::{Args, Subcommand};
use serde_json::{Map, json};

use crate::cli::output::context::Context;
use crate::cli::output::screen::{Palette, Tone};
use mocban_config::{Origin, Setting, explanation};
use mocban_project::{ExitCode, ProjectResult};

/// Commands on settings.
#[derive(Debug, Subcommand)]
pub(crate) enum ConfigCommand {
    /// Print every setting
    Show(ConfigShowArgs),
}

/// Arguments of `config show`.
#[derive(Debug, Default, Args)]
pub(crate) struct ConfigShowArgs {
    /// Print where each value came from
    #[arg(long)]
    pub(crate) origin: bool,
    /// Print what each setting means, its range and the reason for its default
    #[arg(long)]
    pub(crate) explain: bool,
}

pub(crate) fn config(command: &ConfigCommand, context: &Context) -> ProjectResult<ExitCode> {
    let ConfigCommand::Show(args) = command;
    let settings = context.location.settings()?.tree.settings();
    context.print(&as_json(&settings), || {
        as_toml(&settings, args, context.stdout)
    })?;
    Ok(ExitCode::Done)
}

fn as_json(settings: &[Setting]) -> serde_json::Value {
    let values: Map<String, serde_json::Value> = settings
        .iter()
        .map(|setting| {
            let value = json!({"value": setting.value, "origin": setting.origin.to_string()});
            (setting.key.clone(), value)
        })
        .collect();
    json!({"schema": 1, "settings": values})
}

/// Formats settings as a settings file. On request, adds the origin and explanation of each setting as comments.
pub(crate) fn as_toml(settings: &[Setting], args: &ConfigShowArgs, palette: Palette) -> String {
    let longest = settings.iter().map(|setting| line(setting).len()).max();
    let mut lines = Vec::new();
    let (mut section, mut comment) = ("", Vec::new());
    for setting in settings {
        let (current, _) = setting.key.rsplit_once('.').unwrap_or(("", &setting.key));
        if current != section {
            if !lines.is_empty() {
                lines.push(String::new());
            }
            lines.push(palette.paint(Tone::Strong, format!("[{current}]")));
            section = current;
        }
        let explained = explanation(&setting.key);
        if args.explain && explained != comment {
            let paint = |text: &&str| palette.paint(Tone::Faint, format!("# {text}"));
            lines.extend(explained.iter().map(paint));
            comment = explained;
        }
        let line = line(setting);
        let blanks = " ".repeat(longest.unwrap_or(0) - line.len());
        lines.push(if args.origin {
            format!("{line}{blanks}  {}", origin(setting, palette))
        } else {
            line
        });
    }
    lines.iter().flat_map(|line| [line, "\n"]).collect()
}

fn origin(setting: &Setting, palette: Palette) -> String {
    let tone = match setting.origin {
        Origin::Default => Tone::Faint,
        Origin::Preset(_) | Origin::File(_) | Origin::Env(_) | Origin::Flag => Tone::Warn,
    };
    palette.paint(tone, format!("# {}", setting.origin))
}

fn line(setting: &Setting) -> String {
    let key = setting.key.rsplit('.').next().unwrap_or(&setting.key);
    format!("{key} = {}", setting.value)
}

#[cfg(test)]
mod tests {
    use super::{ConfigShowArgs, Palette, as_toml};
    use mocban_config::{Origin, Setting};

    #[test]
    fn output_is_a_settings_file() {
        let setting = |key: &str, value: toml::Value, origin| Setting {
            key: key.to_owned(),
            value,
            origin,
        };
        let settings = [
            setting("run.workers", 2.into(), Origin::Flag),
            setting("limits.mesh.max_bytes", 7.into(), Origin::Default),
            setting("fit.side", "auto".into(), Origin::Preset("paper")),
        ];
        let args = ConfigShowArgs {
            origin: true,
            explain: true,
        };
        let text = as_toml(&settings, &args, Palette::PLAIN);
        let table: toml::Table = text.parse().expect("valid TOML");
        assert_eq!(table["limits"]["mesh"]["max_bytes"].as_integer(), Some(7));
        assert_eq!(
            text.lines().next_back(),
            Some("side = \"auto\"  # preset paper")
        );
    }
}
