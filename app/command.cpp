#include "app/command.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fcntl.h>
#include <fmt/format.h>
#include <fstream>
#include <iostream>
#include <iterator>
#include <new>
#include <semaphore.h>
#include <string_view>
#include <sys/auxv.h>
#include <system_error>
#include <thread>
#include <unistd.h>

#include "engine/io/error.h"
#include "engine/io/files.h"
#include "physics/geometry/hash.h"

namespace app {

namespace {

std::atomic<bool> stopped = false;  // a signal has come
std::atomic<bool> heard = false;    // the command knows
sem_t signal_came;

/// Waits for a signal, at most so long.
bool signal_within(int milliseconds) {
    timespec until{};
    ::clock_gettime(CLOCK_REALTIME, &until);
    until.tv_nsec += static_cast<long>(milliseconds % 1000) * 1'000'000;
    until.tv_sec += milliseconds / 1000 + until.tv_nsec / 1'000'000'000;
    until.tv_nsec %= 1'000'000'000;
    while (::sem_timedwait(&signal_came, &until) != 0)
        if (errno != EINTR) return false;
    return true;
}

/// Ends the program when it was asked to and does not by itself: at once where it makes something that cannot
/// be kept, else after it has had time to write what it has.
void end_when_asked() {
    constexpr int deaf = 500, busy = 10'000;  // [ms]
    while (::sem_wait(&signal_came) != 0) {
    }
    if (!signal_within(deaf) && heard) signal_within(busy);
    io::remove_unfinished();
    constexpr std::string_view said = "\ninterrupted: nothing unfinished was kept\n";
    [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, said.data(), said.size());
    std::_Exit(interrupted);
}

/// As a program does that writes to a reader who has left.
[[noreturn]] void end_without_reader() {
    io::remove_unfinished();
    std::signal(SIGPIPE, SIG_DFL);
    std::raise(SIGPIPE);
    std::_Exit(128 + SIGPIPE);  // where the signal is blocked
}

/// What a system's refusal that no other place has put into words says.
std::string of_system(const std::system_error& error) {
    if (error.code() == std::errc::resource_unavailable_try_again)
        return "expected to start another thread, found no room for it within the limits of memory and "
               "processes (ulimit -v, -u)";
    return error.what();
}

/// Reports what the action throws, and an output that could not be written.
int guarded(const CLI::App& parser, const std::function<int()>& action) {
    std::string wrong;
    try {
        const int code = action();
        if (std::fflush(stdout) != 0) write_out({});
        return code;
    } catch (const Interrupted&) {
        return interrupted;
    } catch (const BadArgument& error) {
        tell("{}\n", refusal(parser, error.what()));
        return bad_input;
    } catch (const std::bad_alloc&) {
        wrong = "expected more memory, or a smaller mesh, image or scenario";
    } catch (const std::filesystem::filesystem_error& error) {
        wrong = fmt::format("{}: {}", error.path1().string(), error.code().message());
    } catch (const std::system_error& error) {
        wrong = of_system(error);
    } catch (const std::runtime_error& error) {
        wrong = error.what();
    } catch (const std::exception& error) {
        wrong = fmt::format("a defect of this program ended the command ({})", error.what());
    }
    tell("seldinger: {}\n", wrong);
    return bad_input;
}

}  // namespace

void catch_signals() {
    // The next file that is opened would take the number of a closed one, and text for people would go into
    // it.
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        if (::fcntl(stream, F_GETFD) == -1 && errno == EBADF)
            // Standard output stays one that cannot be written to.
            static_cast<void>(::open("/dev/null", stream == STDOUT_FILENO ? O_RDONLY : O_RDWR));
    ::sem_init(&signal_came, 0, 0);
    try {
        std::thread(end_when_asked).detach();
    } catch (const std::system_error& error) {
        tell("seldinger: {}\n", of_system(error));
        std::_Exit(bad_input);
    }
    for (const int signal : {SIGXFSZ, SIGPIPE}) std::signal(signal, SIG_IGN);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
        struct sigaction action {};
        action.sa_handler = [](int) {
            stopped = true;
            ::sem_post(&signal_came);
        };
        // As nohup wants it.
        struct sigaction before {};
        if (::sigaction(signal, nullptr, &before) == 0 && before.sa_handler == SIG_IGN) continue;
        ::sigaction(signal, &action, nullptr);
    }
}

bool stop_requested() {
    if (stopped) heard = true;
    return stopped;
}

int run_action(CLI::App& parser, int count, char** values, const std::function<int()>& action) {
    return guarded(parser, [&] {
        if (const std::optional<int> code = parse(parser, count, values)) return *code;
        return action();
    });
}

void write_out(const std::string& text) {
    if (std::fputs(text.c_str(), stdout) != EOF && std::ferror(stdout) == 0) return;
    if (errno == EPIPE) end_without_reader();
    if (errno == EINTR && stop_requested()) throw Interrupted();
    throw std::system_error(errno, std::generic_category(), "standard output");
}

const char* const program = "seldinger " SELDINGER_VERSION;

script::Origin origin(const std::string& learner) {
    const std::string self = io::read_text(program_file(), "program", "expected the program itself");
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

void report_on(ProgressBar& bar, anatomy::ModelCache& cache) {
    cache.progress = [&bar](double part, const char* what) { bar.show(part, what); };
    cache.note = [](const std::string& text) { tell("note: {}\n", text); };
}

scenario::ExerciseFolders exercise_folders(const std::vector<std::string>& named) {
    const std::filesystem::path users = user_folder("XDG_DATA_HOME", ".local/share");
    return {assets(), users.empty() ? users : users / "exercises", {named.begin(), named.end()}};
}

std::filesystem::path catalogue() {
    return assets() / "devices";
}

scenario::Scenario load_exercise(const std::filesystem::path& file, const std::vector<std::string>& set,
                                 const std::string& patient) {
    scenario::Scenario scenario = scenario::load_scenario(file, catalogue(), overrides_of(set), patient);
    if (const auto folder = user_folder("XDG_DATA_HOME", ".local/share"); !folder.empty())
        if (scenario::Benchmark own = scenario::benchmark_in(folder, scenario.name); own.given())
            scenario.lesson.benchmark = std::move(own);
    return scenario;
}

namespace {

void tell_of_hidden(const scenario::ExerciseFiles& files) {
    for (const std::filesystem::path& hidden : files.hides)
        tell("note: {} is taken, not {}\n", files.file.string(), hidden.string());
}

}  // namespace

scenario::ExerciseFiles exercise_named(const ScenarioChoice& choice) {
    scenario::ExerciseFiles files = exercise_folders(choice.exercises).find(choice.named);
    tell_of_hidden(files);
    return files;
}

std::vector<LoadedExercise> loaded(const std::vector<scenario::ExerciseFiles>& all) {
    std::vector<LoadedExercise> list;
    for (const scenario::ExerciseFiles& files : all) try {
            tell_of_hidden(files);
            list.push_back({files, load_exercise(files.file)});
        } catch (const io::InputError& error) {
            tell("note: {} is left out: {}\n", files.file.string(), error.what());
        }
    std::ranges::stable_sort(list, {}, [](const LoadedExercise& one) {
        const scenario::Lesson& lesson = one.scenario.lesson;
        return std::pair(lesson.level > 0 ? lesson.level : scenario::Lesson::levels + 1,
                         lesson.benchmark.completed_after.mean());
    });
    return list;
}

scenario::Scenario scenario_named(const ScenarioChoice& choice, const std::vector<std::string>& set) {
    return load_exercise(exercise_named(choice).file, set, choice.patient);
}

scenario::Scenario scenario_of(const script::CommandScript& recording, const ScenarioChoice& choice) {
    const std::string patient =
        !choice.patient.empty() || !recording.origin ? choice.patient : recording.origin->patient;
    if (!choice.named.empty()) return scenario_named({choice.named, choice.exercises, patient});
    return load_exercise(exercise_folders(choice.exercises).of_recording(recording, catalogue()).file, {},
                         patient);
}

std::optional<script::CommandScript> script_for(const scenario::ExerciseFiles& exercise,
                                                const std::string& named) {
    if (named == "-") {
        const std::string typed(std::istreambuf_iterator<char>(std::cin), {});
        if (stop_requested()) throw Interrupted();  // in mid-script
        return script::parse_commands(typed, "standard input");
    }
    const bool solves = named.empty() || named == "solution";
    if (!solves) return script::load_commands(named);
    if (!exercise.solution.empty()) return script::load_commands(exercise.solution);
    if (!named.empty())
        throw io::InputError("--commands solution: expected {0}.gw beside {1}, found none", exercise.name,
                             exercise.file.string());
    return std::nullopt;
}

script::CommandScript required_script(const scenario::ExerciseFiles& exercise, const std::string& named) {
    return script_for(exercise, named.empty() ? "solution" : named).value();
}

void add_exercises(CLI::App* parser, std::vector<std::string>& folders, const char* names) {
    parser
        ->add_option(names, folders,
                     "Folder of exercises of your own, NAME.toml with NAME.gw and NAME.png, besides those "
                     "that ship and ~/.local/share/seldinger/exercises; again for more")
        ->type_name("FOLDER");
}

void add_patient(CLI::App* parser, ScenarioChoice& choice) {
    parser
        ->add_option(
            "--patient", choice.patient,
            "Another patient of the exercise: a number in its list ('seldinger list NAME'), or seed:17 "
            "for one drawn from a seed")
        ->type_name("PATIENT");
}

void add_scenario(CLI::App* parser, ScenarioChoice& choice) {
    parser->add_option("scenario", choice.named, "A scenario file (.toml), or the name of an exercise")
        ->required()
        ->type_name("SCENARIO");
    add_exercises(parser, choice.exercises);
}

void add_scenario_of_recording(CLI::App* parser, ScenarioChoice& choice) {
    parser
        ->add_option("--scenario", choice.named,
                     "The scenario it was recorded in, where that is not found: a file (.toml)")
        ->type_name("SCENARIO");
    add_exercises(parser, choice.exercises);
    add_patient(parser, choice);
}

void add_cache_folder(CLI::App* parser, std::string& folder, const char* otherwise) {
    parser
        ->add_option("--cache", folder,
                     fmt::format("Folder that keeps grown vessels and distance fields; else {}", otherwise))
        ->type_name("FOLDER");
}

CLI::Option* add_script(CLI::App* parser, std::string& named, const char* otherwise) {
    return parser
        ->add_option("--commands", named,
                     fmt::format("Script or recording (.gw); 'solution' is the exercise's; - reads standard "
                                 "input{}{}",
                                 otherwise ? "; else " : "", otherwise ? otherwise : ""))
        ->type_name("FILE");
}

void add_overrides(CLI::App* parser, std::vector<std::string>& set) {
    parser
        ->add_option("--set", set,
                     "In place of the scenario's value, such as guidewire.friction=0.1; again for more")
        ->type_name("KEY=VALUE")
        ->check(key_and_value());
}

void add_learner(CLI::App* parser, std::string& learner) {
    parser->add_option("--learner", learner, "Whose recording it is: a name, for 'course'")
        ->type_name("NAME")
        ->check(text_that([](const std::string& name) { return name.empty() || script::is_learner(name); },
                          fmt::format("a name in UTF-8 of at most {} bytes without control characters",
                                      script::longest_learner)));
}

std::vector<scenario::Override> overrides_of(const std::vector<std::string>& words) {
    std::vector<scenario::Override> overrides;
    for (const std::string& word : words) {
        const std::size_t equals = word.find('=');
        overrides.push_back({word.substr(0, equals), word.substr(equals + 1)});
    }
    return overrides;
}

std::filesystem::path program_file() {
    // Not /proc/self/exe, which is the loader where a portable archive brings its own.
    std::ifstream maps("/proc/self/maps");
    const auto here = reinterpret_cast<std::uintptr_t>(&program_file);
    for (std::string line; std::getline(maps, line);) {
        std::uintptr_t begin = 0, end = 0;
        int path = 0;
        if (std::sscanf(line.c_str(), "%zx-%zx %*s %*s %*s %*s %n", &begin, &end, &path) == 2 && path > 0 &&
            begin <= here && here < end)
            return line.substr(static_cast<std::size_t>(path));
    }
    // Where /proc is not mounted, the name that the system was given.
    const auto* const name = reinterpret_cast<const char*>(::getauxval(AT_EXECFN));
    std::error_code failed;
    const std::filesystem::path path = name ? std::filesystem::canonical(name, failed) : "";
    if (name && !failed) return path;
    throw io::InputError("/proc/self/maps: expected /proc to be mounted, found no entry of this program");
}

std::filesystem::path program_folder() {
    return program_file().parent_path();
}

std::filesystem::path assets() {
    const char* named = std::getenv("SELDINGER_ASSETS");
    const std::filesystem::path folder =
        named ? std::filesystem::path(named) : program_folder().parent_path() / "share" / "seldinger";
    if (!std::filesystem::is_directory(folder / "scenarios"))
        throw io::InputError("{}: expected a folder of assets with scenarios/ and scripts/{}, found none",
                             folder.string(),
                             named ? ", as SELDINGER_ASSETS names it" : ", beside the program's own");
    return folder;
}

}  // namespace app
