#pragma once
/// Fixtures that several engine tests share.

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <source_location>
#include <sstream>
#include <string>
#include <unistd.h>
#include <vector>

#include "engine/scenario/scenario.h"

namespace test {

/// A folder for one test, removed afterwards.
class TemporaryFolder {
public:
    TemporaryFolder() {
        std::string name = (std::filesystem::temp_directory_path() / "seldinger_test_XXXXXX").string();
        if (!mkdtemp(name.data())) throw std::runtime_error("no temporary folder");
        path_ = name;
    }
    ~TemporaryFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
    const std::filesystem::path& path() const { return path_; }

private:
    std::filesystem::path path_;
};

inline void write(const std::filesystem::path& path, const std::string& text) {
    std::ofstream(path, std::ios::binary) << text;
}
inline std::string read(const std::filesystem::path& path) {
    std::stringstream text;
    text << std::ifstream(path, std::ios::binary).rdbuf();
    return text.str();
}

inline std::filesystem::path asset(const std::string& name) {
    return std::filesystem::path(SELDINGER_SOURCE) / "assets" / name;
}

/// The message of the Error that `call` throws; empty when it throws nothing.
template <class Error = io::InputError, class Call>
std::string refusal(Call&& call) {
    try {
        call();
    } catch (const Error& error) {
        return error.what();
    }
    return "";
}

/// Holds that `expected` is part of what was said; a failure names the caller's line.
inline void expect_said(const std::string& said, const std::string& expected,
                        const std::source_location& where = std::source_location::current()) {
    if (said.find(expected) == std::string::npos)
        ADD_FAILURE_AT(where.file_name(), static_cast<int>(where.line()))
            << "expected '" << expected << "', found:\n"
            << said;
}

/// Holds that `call` throws an Error whose message has `expected` in it.
template <class Error = io::InputError, class Call>
void expect_refusal(Call&& call, const std::string& expected,
                    const std::source_location& where = std::source_location::current()) {
    expect_said(refusal<Error>(call), expected, where);
}

/// Names of what is in a folder, sorted.
inline std::vector<std::string> names_in(const std::filesystem::path& folder) {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        names.push_back(entry.path().filename());
    std::ranges::sort(names);
    return names;
}

/// A test with a folder of its own.
struct InFolder : testing::Test {
    const TemporaryFolder folder;
};

/// A bent tube of 4 mm with 20 mm of wire inside: a frame takes a millisecond.
inline const char* const small_toml = R"(schema = 1
title = "small"
seed = 3
[tube]
radius_mm = 2.0
around = 16
step_mm = 1.0
path = [{run_mm = 30.0}, {arc_radius_mm = 25.0, angle_deg = 40.0}, {run_mm = 30.0}]
[entry]
end = "start"
inserted_mm = 20.0
[guidewire]
device = "glide035"
frictionless = true
buckling_force_N = 0
[chain]
torsion = "rigid"
[relaxer]
updates_per_frame = 20000
[target]
name = "end"
radius_mm = 3.0
hold_s = 0.2
[c_arm]
isocentre_mm = [40.0, 10.0, 0.0]
pixels = 64
[imaging]
patient = false
)";

inline scenario::Scenario small_scenario(const std::string& toml = small_toml) {
    return scenario::parse_scenario(toml, "small.toml", test::asset("devices"));
}

/// A scenario that ships, with values in place of its own.
inline scenario::Scenario shipped_scenario(const std::string& name,
                                           const std::vector<scenario::Override>& overrides = {}) {
    return scenario::load_scenario(asset("scenarios/" + name + ".toml"), asset("devices"), overrides);
}

/// A text with its first `from` replaced, which must be there.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
    const auto at = text.find(from);
    if (at == std::string::npos) throw std::runtime_error("no '" + from + "' in:\n" + text);
    return text.replace(at, from.size(), to);
}

/// The small scenario with one line replaced (or, for an empty `from`, with a line in front).
inline std::string small_toml_with(const std::string& from, const std::string& to) {
    return replaced(small_toml, from, to);
}
inline scenario::Scenario small_scenario_with(const std::string& from, const std::string& to) {
    return small_scenario(small_toml_with(from, to));
}

/// Gives a device of a tip, a transition and a shaft another torsional rigidity [N·mm²].
inline void set_torsion(physics::DeviceSpec& spec, double torsional_rigidity) {
    scenario::TipAndShaft stiffness = scenario::tip_and_shaft(spec).value();
    stiffness.torsional_rigidity = torsional_rigidity;
    scenario::set_stiffness(spec, stiffness);
}

}  // namespace test
