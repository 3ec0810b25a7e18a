#include "app/command.h"

#include <csignal>
#include <cstdlib>
#include <fmt/format.h>

#include "engine/io/error.h"
#include "engine/io/files.h"
#include "physics/geometry/hash.h"

namespace app {

namespace {

volatile std::sig_atomic_t stopped = 0;

}  // namespace

void catch_signals() {
    std::signal(SIGXFSZ, SIG_IGN);
    for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, [](int) { stopped = 1; });
}

bool stop_requested() {
    return stopped != 0;
}

const char* const program = "seldinger " SELDINGER_VERSION;

script::Origin origin(const std::string& learner) {
    if (!learner.empty() && !script::is_learner(learner))
        throw io::InputError(
            fmt::format("--learner: a name of at most {} bytes without control characters is accepted",
                        script::longest_learner));
    const std::string self = io::read_text("/proc/self/exe", "program", "the program itself is read");
    geometry::Hash hash;
    hash.add(self.data(), self.size());
    script::Origin made;
    made.program = program;
    made.program_hash = hash.value();
    made.learner = learner;
    return made;
}

std::filesystem::path user_folder(const char* variable, const char* under_home) {
    const char *named = std::getenv(variable), *home = std::getenv("HOME");
    if (named && *named) return std::filesystem::path(named) / "seldinger";
    if (home && *home) return std::filesystem::path(home) / under_home / "seldinger";
    return {};
}

std::filesystem::path usual_cache(const std::string& named) {
    return named.empty() ? user_folder("XDG_CACHE_HOME", ".cache") : std::filesystem::path(named);
}

scenario::Scenario scenario_of(const script::CommandScript& recording, const std::string& named) {
    std::string wanted = named;
    if (wanted.empty() && recording.origin) wanted = recording.origin->scenario;
    if (wanted.empty())
        throw io::InputError(
            fmt::format("{}: it does not say which scenario it is of; --scenario NAME or FILE is accepted",
                        recording.file));
    return scenario::load_scenario(scenario::find_scenario(wanted, assets() / "scenarios"),
                                   assets() / "devices");
}

std::vector<scenario::Override> overrides_of(const std::vector<std::string>& words) {
    std::vector<scenario::Override> overrides;
    for (const std::string& word : words) {
        const std::size_t equals = word.find('=');
        if (equals == 0 || equals == std::string::npos)
            throw io::InputError(fmt::format("--set {}: KEY=VALUE is accepted", word));
        overrides.push_back({word.substr(0, equals), word.substr(equals + 1)});
    }
    return overrides;
}

std::filesystem::path program_folder() {
    return std::filesystem::read_symlink("/proc/self/exe").parent_path();
}

std::filesystem::path assets() {
    const char* named = std::getenv("SELDINGER_ASSETS");
    const std::filesystem::path folder =
        named ? std::filesystem::path(named) : program_folder().parent_path() / "share" / "seldinger";
    if (!std::filesystem::is_directory(folder / "scenarios"))
        throw io::InputError(fmt::format(
            "{}: no folder of assets was found{}; one with scenarios/ and scripts/ is accepted",
            folder.string(), named ? " (named by SELDINGER_ASSETS)" : ", where the program looks for them"));
    return folder;
}

}  // namespace app
