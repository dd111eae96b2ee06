// Included by the examples of this crate: the default settings of the stages.
fn default_settings() -> Result<mocban_align::stages::Settings, Box<dyn std::error::Error>> {
    let text = include_str!("../../../config/default.toml");
    let mut table: toml::Table = text.parse()?;
    let stages = ["pipeline", "fit", "depth", "normalize", "register"];
    table.retain(|name, _| stages.contains(&name.as_str()));
    Ok(table.try_into()?)
}
