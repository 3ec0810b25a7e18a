#include "engine/anatomy/grow/vessel_file.h"

#include <cmath>
#include <fmt/format.h>
#include <toml++/toml.h>

#include "engine/anatomy/grow/vessel_presets.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/io/toml_section.h"
#include "physics/geometry/vec.h"

namespace anatomy {
namespace {

constexpr io::Range along{0, 5000};  // a centreline [mm]

void read_points(io::Section& section, std::vector<VesselKnot>& knots) {
    const toml::node* node = section.find("points_mm");
    if (!node) {
        section.missing("points_mm", "points_mm = [[x, y, z, radius], …]");
        return;
    }
    const toml::array* list = node->as_array();
    if (!list) section.refuse("points_mm", *node, "expected a list of [x, y, z, radius]");
    for (std::size_t i = 0; list && i < list->size(); ++i) {
        const toml::array* numbers = (*list)[i].as_array();
        std::array<double, 4> read{};
        bool fine = numbers && numbers->size() == 4;
        for (std::size_t k = 0; fine && k < 4; ++k) {
            const std::optional<double> number =
                (*numbers)[k].is_number() ? (*numbers)[k].value<double>() : std::nullopt;
            fine = number && std::isfinite(*number);
            if (fine) read[k] = *number;
        }
        if (!fine) {
            section.refuse("points_mm", (*list)[i], "expected four numbers x, y, z and radius");
            return;
        }
        knots.push_back({{read[0], read[1], read[2]}, read[3]});
    }
}

void read_branches(io::Section& top, VesselTreeSpec& spec) {
    for (io::Section& section : top.sections("branch")) {
        BranchSpec branch;
        if (!section.word("name", branch.name)) section.missing("name", "name of the branch");
        section.word("parent", branch.parent);
        section.number("at_mm", branch.at, along);
        section.flag("closed", branch.closed);
        if (section.word("joins", branch.joins)) {
            section.number("joins_at_mm", branch.joins_at, along);
            if (!section.find("joins_at_mm")) section.missing("joins_at_mm", "joins_at_mm");
        }
        read_points(section, branch.knots);
        section.finish();
        spec.branches.push_back(std::move(branch));
    }
}

/// Reads every section of that name; `read` takes the keys of one into its item.
template <class Item, class Read>
void read_each(io::Section& top, std::string_view name, std::vector<Item>& items, Read read) {
    for (io::Section& section : top.sections(name)) {
        Item item;
        read(section, item);
        section.finish();
        items.push_back(std::move(item));
    }
}

/// The same for what lies at a place on a branch.
template <class Item, class Read>
void read_placed(io::Section& top, std::string_view name, std::vector<Item>& items, Read read) {
    read_each(top, name, items, [&](io::Section& section, Item& item) {
        if (!section.word("branch", item.branch)) section.missing("branch", "branch");
        section.number("at_mm", item.at, along);
        read(section, item);
    });
}

void read_angle(io::Section& section, double& angle) {
    section.number("angle_deg", angle, {-360, 360}, geometry::degree);
}

void read_modifiers(io::Section& top, VesselTreeSpec& spec) {
    read_placed(top, "target", spec.targets, [](io::Section& section, NamedTarget& target) {
        if (!section.word("name", target.name)) section.missing("name", "name of the target");
    });
    read_each(top, "tortuosity", spec.tortuosities, [](io::Section& section, Tortuosity& tortuosity) {
        section.word("branch", tortuosity.branch);
        section.number("amplitude_mm", tortuosity.amplitude, {0, 50});
        section.number("wavelength_mm", tortuosity.wavelength, {2, 500});
    });
    read_placed(top, "stenosis", spec.stenoses, [](io::Section& section, Stenosis& stenosis) {
        stenosis.asked = section.place();
        section.number("length_mm", stenosis.length, {1, 200});
        section.number("percent", stenosis.percent, {0, 90});
        section.number("eccentricity", stenosis.eccentricity, {0, 1});
        read_angle(section, stenosis.angle);
        section.flag("calcified", stenosis.calcified);
    });
    read_placed(top, "fusiform_aneurysm", spec.fusiform, [](io::Section& section, FusiformAneurysm& a) {
        section.number("length_mm", a.length, {2, 400});
        section.number("diameter_mm", a.diameter, {1, 60});
    });
    read_placed(top, "occlusion", spec.occlusions, [](io::Section&, Occlusion&) {});
    read_placed(top, "dissection", spec.dissections, [](io::Section& section, Dissection& dissection) {
        section.number("length_mm", dissection.length, {10, 600});
        section.number("true_share", dissection.true_fraction, {0.2, 0.8});
        section.number("flap_mm", dissection.flap, {0.5, 6});
        read_angle(section, dissection.angle);
    });
    read_placed(top, "aneurysm", spec.aneurysms, [](io::Section& section, Aneurysm& aneurysm) {
        section.number("diameter_mm", aneurysm.diameter, {1, 60});
        section.number("neck_mm", aneurysm.neck, {0.4, 60});
        read_angle(section, aneurysm.angle);
    });
}

/// What the section says of the patient, in place of what was wished before.
PatientWish read_patient(io::Section& section, PatientWish wish) {
    static constexpr std::string_view sexes[] = {"f", "m"};
    if (const auto sex = section.choice("sex", sexes)) wish.sex = *sex == 0 ? Sex::Female : Sex::Male;
    constexpr double mm_per_cm = 10;
    section.number("age", wish.age, {youngest, oldest});
    section.number("height_cm", wish.height, {shortest / mm_per_cm, tallest / mm_per_cm}, mm_per_cm);
    section.number("weight_kg", wish.weight, {lightest, heaviest});
    return wish;
}

void complete(io::Section& section, VesselTreeSpec& spec) {
    try {
        complete_branch_names(spec);
    } catch (const io::InputError& error) {
        section.refuse_whole(error.what());
    }
}

/// The spec given by the section; `seed` and patient apply to the preset.
VesselTreeSpec read_spec(io::Section& section, io::ParseContext& reading, std::uint64_t seed,
                         const PatientWish& wished) {
    VesselTreeSpec spec;
    const PatientWish wish = read_patient(section, wished);
    std::string preset;
    const bool from_preset = section.word("preset", preset);
    if (from_preset) {
        try {
            spec = vessel_preset(preset, seed, wish);
        } catch (const io::InputError& error) {
            reading.refuse(section.find("preset")->source(), error.what());
        }
    }
    for (const std::string_view key : {"sex", "age", "height_cm", "weight_kg"}) {
        const toml::node* node = section.find(key);
        if (node && !from_preset)
            section.refuse(key, *node, "expected a preset for it, and there is none here");
    }
    if (!from_preset && (wished.sex || wished.age || wished.height || wished.weight))
        section.refuse_whole(
            "sex, age, height or weight was given; expected a preset whose patient they describe");
    if (!from_preset && seed != 0)
        section.refuse_whole(
            fmt::format("seed {} was given; expected a preset for it, and there is none here", seed));
    read_branches(section, spec);
    if (!from_preset && !section.find("branch"))
        section.missing("branch", "preset = \"…\" or a section [[branch]]");
    read_modifiers(section, spec);
    complete(section, spec);
    return spec;
}

/// The parts between colons; those from `first` on are numbers. There must be `least` to `most` parts in all.
struct Parts {
    std::vector<std::string_view> words;
    std::vector<double> numbers;
};
Parts split(const std::string& text, std::size_t least, std::size_t most, std::size_t first,
            std::size_t count, std::string_view option, std::string_view shape) {
    Parts parts{io::split(text, ':'), {}};
    if (parts.words.back().empty()) parts.words.pop_back();
    bool fine = parts.words.size() >= least && parts.words.size() <= most;
    for (std::size_t i = first; fine && i < std::min(first + count, parts.words.size()); ++i) {
        const std::optional<double> number = io::parse_number(parts.words[i]);
        fine = number && std::isfinite(*number);
        if (fine) parts.numbers.push_back(*number);
    }
    if (!fine) throw io::InputError("{}: '{}' was found; expected {}", option, text, shape);
    return parts;
}

}  // namespace

VesselTreeSpec parse_vessel_file(const std::string& text, const std::filesystem::path& file,
                                 std::uint64_t seed, const PatientWish& wish) {
    io::ParseContext reading{file.string(), {}, {}};
    const toml::table root = reading.parse(text);
    io::Section top(reading, &root, "");
    top.schema();
    VesselTreeSpec spec = read_spec(top, reading, seed, wish);
    top.finish();
    reading.end();
    spec.name = file.stem().string();
    for (const std::string& problem : problems(spec))
        reading.wrong.emplace_back(io::TextPlace{reading.file, 0, 0}, problem);
    reading.end();
    return spec;
}

VesselTreeSpec load_vessel_file(const std::filesystem::path& path, std::uint64_t seed,
                                const PatientWish& wish) {
    return parse_vessel_file(io::read_text(path, "vessel tree", "expected a .toml file"), path, seed, wish);
}

VesselTreeSpec read_vessels(io::Section& section, io::ParseContext& reading, const std::string& name) {
    std::uint64_t seed = 0;
    section.whole("seed", seed, {0, 9e15});
    VesselTreeSpec spec;
    if (std::string tree; section.word("tree", tree)) {
        const std::filesystem::path path = std::filesystem::path(reading.file).parent_path() / tree;
        reading.files.push_back(path);
        try {
            spec = load_vessel_file(path, seed, read_patient(section, {}));
        } catch (const io::InputError& error) {
            reading.refuse(section.find("tree")->source(), error.what());
        }
        read_modifiers(section, spec);
        complete(section, spec);
    } else {
        spec = read_spec(section, reading, seed, {});
        if (spec.name.empty()) spec.name = name;
    }
    spec.name = name_of_grown(spec.name, seed);
    section.finish();
    if (reading.wrong.empty()) {
        for (const std::string& problem : problems(spec)) section.refuse_whole(problem);
    }
    return spec;
}

Sex parse_sex(const std::string& text) {
    if (text == "f") return Sex::Female;
    if (text == "m") return Sex::Male;
    throw io::InputError("--sex: '{}' was found; expected f or m", text);
}

Stenosis parse_stenosis(const std::string& text) {
    const Parts p = split(text, 4, 4, 1, 3, "--stenosis", "BRANCH:AT:LENGTH:PERCENT");
    return {std::string(p.words[0]), p.numbers[0], p.numbers[1], p.numbers[2]};
}

Aneurysm parse_aneurysm(const std::string& text) {
    const Parts p = split(text, 4, 5, 1, 4, "--aneurysm", "BRANCH:AT:DIAMETER:NECK[:ANGLE]");
    return {std::string(p.words[0]), p.numbers[0], p.numbers[1], p.numbers[2],
            p.numbers.size() > 3 ? p.numbers[3] * geometry::degree : 0};
}

Tortuosity parse_tortuosity(const std::string& text) {
    const Parts p = split(text, 2, 3, 0, 2, "--tortuosity", "AMPLITUDE:WAVELENGTH[:BRANCH]");
    return {p.words.size() > 2 ? std::string(p.words[2]) : std::string(), p.numbers[0], p.numbers[1]};
}

}  // namespace anatomy
