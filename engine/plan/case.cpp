#include "engine/plan/case.h"

#include <algorithm>
#include <fmt/format.h>
#include <set>
#include <sstream>
#include <toml++/toml.h>

#include "engine/anatomy/anatomy.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/scenario/lesson_file.h"

namespace plan {
namespace {

using script::DeviceRole;

constexpr std::array<std::string_view, script::most_devices> sections = {
    "guidewire", "microcatheter", "intermediate", "balloon", "catheter", "sheath"};

toml::table table_of(const CaseText& text) {
    io::check_toml_depth(text.toml, text.file.string());
    try {
        return toml::parse(text.toml, text.file.string());
    } catch (const toml::parse_error& error) {
        throw io::InputError("{}:{}:{}: {}", text.file.string(), error.source().begin.line,
                             error.source().begin.column, error.description());
    }
}

CaseText text_of(const toml::table& table, const std::filesystem::path& file) {
    std::ostringstream text;
    text << table << "\n";
    return {text.str(), file};
}

toml::table& section(toml::table& table, std::string_view name) {
    if (!table[name].is_table()) table.insert_or_assign(name, toml::table{});
    return *table[name].as_table();
}

/// "a", "b", or "c".
std::string list_of(std::vector<std::string> names) {
    constexpr std::size_t most = 12;
    const std::size_t all = names.size();
    names.resize(std::min(all, most));
    return io::joined(names) + (all > most ? fmt::format(" and {} more", all - most) : "");
}

/// The role of a device around a wire: what is thinner than 1.2 mm is a microcatheter.
DeviceRole role_of(const scenario::Device& device) {
    if (device.kind == scenario::DeviceKind::Balloon || device.kind == scenario::DeviceKind::Stent)
        return DeviceRole::Balloon;
    constexpr double microcatheter = 1.2;  // [mm]; 3.6 F
    return device.outer_diameter < microcatheter ? DeviceRole::Microcatheter : DeviceRole::Catheter;
}

std::string without_spaces(std::string_view text) {
    std::string plain;
    for (const char c : text)
        if (c != ' ' && c != '\t') plain += c;
    return plain;
}

/// The words between the commas. Throws InputError where there is none.
std::vector<std::string> words_of(const std::string& list, const char* option) {
    std::vector<std::string> words;
    for (const std::string_view part : io::split(list, ',')) {
        words.push_back(without_spaces(part));
        if (words.back().empty())
            throw io::InputError("{} '{}': expected devices between the commas, found nothing", option, list);
    }
    return words;
}

/// Every wire of the catalogue that is as thick as the scenario's.
std::vector<std::string> wires_alike(const scenario::Scenario& scenario,
                                     const std::filesystem::path& catalogue) {
    std::vector<std::string> names;
    for (const std::filesystem::path& file : scenario::device_files(catalogue)) {
        const scenario::Device device = scenario::load_device(file);
        const double other = scenario.wire().device.outer_diameter;
        if (device.kind == scenario::DeviceKind::Wire && std::abs(device.outer_diameter - other) <= 0.1)
            names.push_back(device.name);
    }
    return names;
}

void make_absolute(toml::node& node, const std::filesystem::path& folder) {
    if (auto* text = node.as_string()) {
        const std::string value = text->get();
        if (value.find_first_of("./") == std::string::npos || value.find('\n') != std::string::npos) return;
        std::error_code ignored;
        const std::filesystem::path there = folder / value;
        if (std::filesystem::exists(there, ignored))
            *text = std::filesystem::absolute(there).lexically_normal().string();
    } else if (auto* table = node.as_table()) {
        for (auto&& [key, value] : *table) make_absolute(value, folder);
    } else if (auto* array = node.as_array()) {
        for (auto&& value : *array) make_absolute(value, folder);
    }
}

}  // namespace

std::vector<Candidate> candidates_of(const std::string& list, const scenario::Scenario& scenario,
                                     const std::filesystem::path& catalogue) {
    std::vector<Candidate> all;
    std::set<std::string> names;
    const auto add = [&](Candidate candidate) {
        if (names.insert(candidate.name).second) all.push_back(std::move(candidate));
    };
    for (const std::string& word : words_of(list, "--devices")) {
        if (word == "own") {
            add({});
            continue;
        }
        if (word == "wires") {
            for (const std::string& name : wires_alike(scenario, catalogue))
                add({name, {{DeviceRole::Wire, name}}});
            continue;
        }
        Candidate candidate{word, {}};
        std::set<DeviceRole> taken;
        for (const std::string_view name : io::split(word, '+')) {
            const auto file = scenario::find_device(std::string(name), catalogue);
            const scenario::Device device = scenario::load_device(file);
            const bool is_wire = device.kind == scenario::DeviceKind::Wire;
            if (candidate.devices.empty() != is_wire)
                throw io::InputError("--devices '{}': expected {}, found '{}', a {}", word,
                                     is_wire ? "one wire, the first" : "a wire first", std::string(name),
                                     scenario::name_of(device.kind));
            DeviceRole role = is_wire ? DeviceRole::Wire : role_of(device);
            // Two catheters in each other: the outer one is the sheath.
            if (role == DeviceRole::Catheter && taken.contains(role)) role = DeviceRole::Sheath;
            if (!taken.insert(role).second ||
                (candidate.devices.size() > 0 && role < candidate.devices.back().first))
                throw io::InputError(
                    "--devices '{}': expected devices from the innermost outward, found '{}' "
                    "after '{}'",
                    word, std::string(name), candidate.devices.back().second);
            candidate.devices.emplace_back(role, std::string(name));
        }
        if (candidate.devices.size() > static_cast<std::size_t>(physics::most_devices))
            throw io::InputError("--devices '{}': expected up to {} devices, found {}", word,
                                 physics::most_devices, candidate.devices.size());
        add(std::move(candidate));
    }
    return all;
}

std::vector<std::string> wires_of(const std::string& list, const scenario::Scenario& scenario,
                                  const std::filesystem::path& catalogue) {
    std::vector<std::string> all;
    const auto add = [&all](const std::string& name) {
        if (std::ranges::find(all, name) == all.end()) all.push_back(name);
    };
    if (list.empty()) return all;
    for (const std::string& word : words_of(list, "--exchange")) {
        if (word == "wires") {
            for (const std::string& name : wires_alike(scenario, catalogue)) add(name);
            continue;
        }
        const scenario::Device device = scenario::load_device(scenario::find_device(word, catalogue));
        if (device.kind != scenario::DeviceKind::Wire)
            throw io::InputError("--exchange '{}': expected wires, found '{}', a {}", list, word,
                                 scenario::name_of(device.kind));
        add(word);
    }
    return all;
}

CaseText case_of(const std::filesystem::path& file, const std::string& wire) {
    if (!file.string().ends_with(".anatomy.json"))
        return {io::read_text(file, "scenario", "expected a .toml file"), file};
    const anatomy::Anatomy anatomy = anatomy::load_anatomy(file);
    if (anatomy.ends.empty())
        throw io::InputError("{}: expected vessels with an open end to enter by, found none", file.string());
    geometry::Vec3 low = geometry::Vec3::Constant(1e9), high = -low;
    for (const auto& branch : anatomy.branches)
        for (const geometry::Vec3& point : branch.points) {
            low = low.cwiseMin(point);
            high = high.cwiseMax(point);
        }
    const geometry::Vec3 middle = 0.5 * (low + high);
    const auto array = [](const geometry::Vec3& p) { return toml::array{p.x(), p.y(), p.z()}; };
    toml::table table;
    table.insert("schema", 1);
    table.insert("title", fmt::format("A plan for {}", anatomy.name));
    table.insert("anatomy", file.filename().string());
    table.insert("entry", toml::table{{"end", anatomy.ends.front().opening.name}});
    table.insert("guidewire", toml::table{{"device", wire}});
    toml::table target{{"radius_mm", 4.0}, {"hold_s", 0.5}};
    if (anatomy.targets.empty()) {
        const auto& branch = anatomy.branches.back();
        target.insert("centre_mm", array(branch.points[branch.points.size() / 2]));
    } else {
        target.insert("name", anatomy.targets.front().name);
    }
    table.insert("target", target);
    table.insert("c_arm", toml::table{{"isocentre_mm", array(middle)}, {"detector_width_mm", 400.0}});
    return text_of(table, file.parent_path() / (anatomy.name + ".toml"));
}

CaseText with_patient(const CaseText& text, const std::string& patient,
                      const std::filesystem::path& catalogue) {
    if (patient.empty() || patient == "1") return text;
    toml::table table = table_of(text);
    const scenario::Scenario usual = scenario::parse_scenario(text.toml, text.file, catalogue);
    for (const auto& [key, value] : scenario::patient_of(usual, patient).values) {
        const toml::table parsed = toml::parse("value = " + value);
        section(table, "anatomy").insert_or_assign(key, *parsed.get("value"));
    }
    return text_of(table, text.file);
}

CaseText with_ends(const CaseText& text, const std::string& to, const std::string& from,
                   const std::filesystem::path& catalogue, const anatomy::ModelCache& cache) {
    if (to.empty() && from.empty()) return text;
    toml::table table = table_of(text);
    const scenario::Scenario usual = scenario::parse_scenario(text.toml, text.file, catalogue);
    const anatomy::Anatomy vessels = scenario::anatomy_of(usual, cache);
    if (!from.empty()) {
        if (!anatomy::find_end(vessels, from)) {
            std::vector<std::string> names;
            for (const anatomy::VesselEnd& end : vessels.ends) names.push_back(end.opening.name);
            throw io::InputError("--from '{}': expected an open end of the vessels, one of {}", from,
                                 list_of(names));
        }
        section(table, "entry").insert_or_assign("end", from);
    }
    if (to.empty()) return text_of(table, text.file);
    toml::table& target = section(table, "target");
    const auto place_at = [&](const geometry::Vec3& place) {
        target.erase("name");
        target.insert_or_assign("centre_mm", toml::array{place.x(), place.y(), place.z()});
    };
    for (const anatomy::VesselTarget& one : vessels.targets)
        if (one.name == to) {
            target.erase("centre_mm");
            target.insert_or_assign("name", to);
            return text_of(table, text.file);
        }
    const std::vector<std::string_view> numbers = io::split(to, ',');
    if (numbers.size() == 3) {
        geometry::Vec3 place;
        bool fine = true;
        for (std::size_t k = 0; k < 3; ++k) {
            const auto number = io::parse_number(io::trimmed(numbers[k]));
            fine = fine && number && std::isfinite(*number);
            place[static_cast<int>(k)] = number.value_or(0);
        }
        if (!fine) throw io::InputError("--to '{}': expected three numbers as '12.5,-3,40' [mm]", to);
        if (!anatomy::inside(vessels, place))
            throw io::InputError(
                "--to '{}': expected a place in the vessels, found one that is {:.1f} mm outside", to,
                anatomy::nearest_place(vessels, place).distance);
        place_at(place);
        return text_of(table, text.file);
    }
    const std::vector<std::string_view> parts = io::split(to, ':');
    const auto branch = anatomy::branch_named(vessels, parts.front());
    if (!branch || parts.size() > 2) {
        std::vector<std::string> names;
        for (const anatomy::VesselTarget& one : vessels.targets) names.push_back(one.name);
        for (const auto& one : vessels.branches) names.push_back(one.name);
        throw io::InputError(
            "--to '{}': expected a target or a branch of the vessels, one of {}; a place on a "
            "branch is 'NAME:20', 20 mm along it",
            to, list_of(names));
    }
    const auto& points = vessels.branches[static_cast<std::size_t>(*branch)].points;
    const double origin = anatomy::origin_of(vessels, *branch);
    const double end = anatomy::along(vessels, {*branch, static_cast<int>(points.size()) - 1, 0}) - origin;
    double at = 0.5 * end;
    if (parts.size() == 2) {
        const auto number = io::parse_number(parts[1]);
        if (!number || !std::isfinite(*number) || *number < 0 || *number > end)
            throw io::InputError("--to '{}': expected 0 to {:.0f} mm along {}", to, end, parts.front());
        at = *number;
    }
    std::size_t k = 0;
    while (k + 1 < points.size() && anatomy::along(vessels, {*branch, static_cast<int>(k), 0}) < origin + at)
        ++k;
    place_at(points[k]);
    return text_of(table, text.file);
}

CaseText with_devices(const CaseText& text, const Candidate& candidate) {
    if (candidate.devices.empty()) return text;
    toml::table table = table_of(text);
    // What the scenario says of devices in the same places.
    std::array<std::optional<double>, script::most_devices> inserted;
    for (std::size_t k = 0; k < sections.size(); ++k)
        inserted[k] = table[sections[k]]["inserted_mm"].value<double>();
    if (const toml::array* list = table["device"].as_array())
        for (const toml::node& one : *list) {
            const toml::table* device = one.as_table();
            if (!device) continue;
            const auto role = script::role_named((*device)["name"].value_or(std::string_view()));
            if (role && *role != DeviceRole::All)
                inserted[static_cast<std::size_t>(*role)] = (*device)["inserted_mm"].value<double>();
        }
    table.erase("device");
    for (const std::string_view name : sections) table.erase(name);
    bool has_target = false;
    const std::string wanted = table["target"]["device"].value_or(std::string("wire"));
    for (const auto& [role, name] : candidate.devices) {
        const auto place = static_cast<std::size_t>(role);
        toml::table device{{"device", name}};
        if (inserted[place]) device.insert("inserted_mm", *inserted[place]);
        table.insert_or_assign(sections[place], device);
        has_target = has_target || script::name_of(role) == wanted;
    }
    if (!has_target) section(table, "target").insert_or_assign("device", "wire");
    // Lesions are opened by a balloon; guided steps speak of what is there.
    if (!table.contains("balloon")) {
        section(table, "target").erase("residual_percent");
    }
    if (toml::table* lesson = table["lesson"].as_table()) lesson->erase("step");
    return text_of(table, text.file);
}

CaseText moved_to(const CaseText& text, const std::filesystem::path& file) {
    toml::table table = table_of(text);
    const std::filesystem::path folder =
        text.file.parent_path().empty() ? std::filesystem::path(".") : text.file.parent_path();
    make_absolute(table, folder);
    return text_of(table, file);
}

}  // namespace plan
