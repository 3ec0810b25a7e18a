#include "engine/scenario/exercise_folders.h"

#include <algorithm>
#include <map>
#include <optional>
#include <toml++/toml.h>

#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/io/toml_section.h"

namespace scenario {
namespace fs = std::filesystem;
namespace {

bool same(const fs::path& a, const fs::path& b) {
    std::error_code ignored;
    return fs::equivalent(a.empty() ? "." : a, b.empty() ? "." : b, ignored);
}

bool is_file(const fs::path& file) {
    std::error_code ignored;
    return fs::is_regular_file(file, ignored);
}

/// A file that is no TOML is taken for a scenario, so that whoever loads it says what is wrong with it.
bool is_scenario(const fs::path& file) {
    try {
        const io::ParseContext reading{file.string(), {}, {}};
        const toml::table root = reading.parse(io::read_text(file, "scenario", "expected a .toml file"));
        return root.contains("entry") || root.contains("target");
    } catch (const io::InputError&) {
        return true;
    }
}

/// Throws InputError for a folder that is missing or cannot be read.
void require_readable(const fs::path& folder) {
    std::error_code error;
    if (!fs::is_directory(folder, error))
        throw io::InputError("{}: expected a folder of exercises, found {}", folder.string(),
                             fs::exists(folder, error) ? "something else" : "nothing of that name");
    const fs::directory_iterator opened(folder, error);
    if (error) throw io::InputError("{}: it cannot be read: {}", folder.string(), error.message());
}

}  // namespace

bool is_exercise_name(std::string_view name) {
    const auto is_letter = [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    };
    return !name.empty() && name.size() <= 64 && is_letter(name.front()) &&
           std::ranges::all_of(name, [&](char c) { return is_letter(c) || c == '-' || c == '_'; });
}

ExerciseFolders::ExerciseFolders(fs::path assets, const fs::path& users, const std::vector<fs::path>& named)
    : assets_(std::move(assets)), users_(users) {
    const auto add = [&](const fs::path& folder) {
        if (std::ranges::none_of(folders_, [&](const fs::path& known) { return same(known, folder); }))
            folders_.push_back(folder);
    };
    std::map<std::string, fs::path> places;
    for (const fs::path& folder : named) {
        require_readable(folder);
        add(folder);
    }
    for (const fs::path& folder : folders_)
        for (const ExerciseFiles& one : in(folder))
            if (const auto [known, fresh] = places.emplace(one.name, one.file); !fresh)
                throw io::InputError("--exercises: expected one exercise '{}', found {} and {}", one.name,
                                     known->second.string(), one.file.string());
    std::error_code ignored;
    if (!users_.empty() && fs::is_directory(users_, ignored)) add(users_);
    add(assets_ / "scenarios");
}

ExerciseFiles ExerciseFolders::of(const fs::path& scenario) const {
    const fs::path folder = scenario.parent_path();
    ExerciseFiles found{scenario.stem().string(), scenario, {}, {}};
    const bool ships = same(folder, assets_ / "scenarios");
    const fs::path solution = (ships ? assets_ / "scripts" : folder) / (found.name + ".gw"),
                   picture = folder / (found.name + ".png");
    if (is_file(solution)) found.solution = solution;
    if (is_file(picture)) found.picture = picture;
    return found;
}

std::vector<ExerciseFiles> ExerciseFolders::in(const fs::path& folder) const {
    std::vector<ExerciseFiles> found;
    for (const fs::path& file : shipped_scenarios(folder))
        if (is_file(file) && is_scenario(file)) found.push_back(of(file));
    return found;
}

std::vector<ExerciseFiles> ExerciseFolders::all() const {
    std::map<std::string, ExerciseFiles> found;
    for (const fs::path& folder : folders_)
        for (ExerciseFiles& one : in(folder)) {
            const auto [known, fresh] = found.try_emplace(one.name, one);
            if (!fresh) known->second.hides.push_back(one.file);
        }
    std::vector<ExerciseFiles> list;
    for (auto& [name, one] : found) list.push_back(std::move(one));
    return list;
}

std::vector<fs::path> ExerciseFolders::files() const {
    std::vector<fs::path> files;
    for (const fs::path& folder : folders_)
        for (const fs::path& file : shipped_scenarios(folder)) files.push_back(file);
    return files;
}

std::string ExerciseFolders::text() const {
    std::vector<std::string> words;
    for (const fs::path& folder : folders_) words.push_back(folder.string());
    return io::joined(words);
}

ExerciseFiles ExerciseFolders::find(const std::string& path_or_name) const {
    io::require_no_device(path_or_name);
    if (is_file(path_or_name)) return of(path_or_name);
    std::optional<ExerciseFiles> found;
    if (path_or_name.find('/') == std::string::npos)
        for (const fs::path& folder : folders_) {
            const fs::path file = folder / (path_or_name + ".toml");
            if (!is_file(file)) continue;
            if (found)
                found->hides.push_back(file);
            else
                found = of(file);
        }
    if (found) return *found;
    std::vector<std::string> names;
    for (const ExerciseFiles& one : all()) names.push_back(one.name);
    const std::vector<std::string_view> words(names.begin(), names.end());
    throw io::InputError(
        "{}: no such scenario{} in {}; expected a .toml file, --exercises FOLDER, or one of these: {}",
        path_or_name, io::suggestion(path_or_name, words), text(), io::joined(names));
}

ExerciseFiles ExerciseFolders::of_recording(const script::CommandScript& recording,
                                            const fs::path& catalogue) const {
    const std::string name = recording.origin ? recording.origin->scenario : "";
    if (name.empty())
        throw io::InputError("{}: it does not say which scenario it is of; expected --scenario NAME or FILE",
                             recording.file);
    // A name out of a recording is no path.
    if (name.find('/') != std::string::npos || name.starts_with("."))
        throw io::InputError("{}: '{}' is no scenario's name", recording.file, name);
    const fs::path beside = fs::absolute(recording.file).lexically_normal().parent_path();
    std::vector<fs::path> places = folders_;
    places.insert(places.end(), {beside, beside.parent_path()});
    std::vector<fs::path> known;
    for (const fs::path& folder : places)
        if (is_file(folder / (name + ".toml"))) known.push_back(folder / (name + ".toml"));
    if (known.empty())
        throw io::InputError(
            "{} is of '{}', which was not found in {}, nor beside it or in the folder above: expected "
            "--exercises FOLDER or --scenario FILE",
            recording.file, name, text());
    if (known.size() > 1 && recording.origin->scenario_hash != 0)
        for (const fs::path& file : known) try {
                if (load_scenario(file, catalogue, {}, recording.origin->patient).content ==
                    recording.origin->scenario_hash)
                    return of(file);
            } catch (const io::InputError&) {
                // Another of that name may be the one; the nearest is loaded again, and says so.
            }
    return of(known.front());
}

}  // namespace scenario
