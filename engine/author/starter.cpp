#include "engine/author/starter.h"

#include <fmt/format.h>
#include <sstream>

#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/scenario/scenario.h"

namespace author {
namespace {

constexpr const char* head =
    "# {0}: an exercise of your own. assets/scenarios/README.md has every key. In this folder:\n"
    "#   seldinger check {0}.toml                      what would be refused\n"
    "#   seldinger list {0}.toml                       its ends, branches and targets, for the names below\n"
    "#   seldinger play {0}.toml                       try it; every attempt is a recording\n"
    "#   seldinger author {0}.toml --from RECORDING    makes its solution and picture; does it forgive 5 "
    "%?\n";

constexpr const char* body = R"(schema = 1
title = "{0}: from the right groin into the aorta"
frame_rate_hz = 15
time_limit_s = 180
seed = 1                       # of the images' noise

# The vessels: 'seldinger anatomy generate --help' lists the presets. Another seed is another patient.
[anatomy]
preset = "iliac-renal"
seed = 0

# The target: a place on a branch, or on a named part of one, from where that begins.
[[anatomy.target]]
name = "goal"
branch = "aorta"
at_mm = 100.0

# Where the introducer is, and how much wire is inside at the start.
[entry]
end = "RCFA.out"
inserted_mm = 60.0

# 'seldinger list devices' names them; [catheter] device = "cobra5f" puts one over the wire.
[guidewire]
device = "glide035"

[wall]
stiffness_N_per_mm = 5.0

# The tip must stay within the radius for the hold.
[target]
name = "goal"
radius_mm = 8.0
hold_s = 0.5

# The view at the start.
[c_arm]
lao_deg = 0.0
cranial_deg = 0.0
isocentre_mm = [0.0, 0.0, -30.0]
detector_width_mm = 400.0

[lesson]
level = 1
briefing = """
Bring the wire from the right groin up the iliac arteries and into the aorta."""
hints = ["Watch the tip where the internal iliac artery leaves."]

[[lesson.view]]
lao_deg = 0.0
cranial_deg = 0.0
shows = "both iliac arteries and the aorta"
)";

/// The first title, which every scenario has, in place of the text's.
std::string with_title(const std::string& text, const std::string& title) {
    std::istringstream lines(text);
    std::string made;
    bool done = false;
    for (std::string line; std::getline(lines, line);) {
        if (!done && line.starts_with("title")) {
            line = fmt::format("title = \"{}\"", title);
            done = true;
        }
        made += line + "\n";
    }
    return made;
}

std::string head_of(const std::string& name) {
    return fmt::format(fmt::runtime(head), name);
}

}  // namespace

std::string starter(const std::string& name) {
    return head_of(name) + fmt::format(fmt::runtime(body), name);
}

std::string starter_from(const std::filesystem::path& scenario, const std::string& name,
                         const std::filesystem::path& folder, const std::filesystem::path& catalogue) {
    const scenario::Scenario source = scenario::load_scenario(scenario, catalogue);
    const std::string text = io::read_text(scenario, "scenario", "expected a .toml file");
    const std::string made = head_of(name) + with_title(text, fmt::format("{}, from {}", name, source.name));
    const std::filesystem::path file = folder / (name + ".toml");
    const scenario::Scenario copy = scenario::parse_scenario(made, file, catalogue);
    std::error_code ignored;
    for (const std::filesystem::path& input : scenario::inputs_of(copy))
        if (input != file && !std::filesystem::exists(input, ignored))
            throw io::InputError(
                "--from {}: it names a file beside it, {}, which is not in {}; expected a scenario without "
                "files of its own, or a folder that has them",
                scenario.string(), input.filename().string(), folder.string());
    return made;
}

}  // namespace author
