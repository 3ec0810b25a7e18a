/// `seldinger serve`: an exercise for a program in any language, by lines.

#include <cstdio>
#include <fmt/format.h>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/command.h"
#include "app/progress_bar.h"
#include "engine/episode/episode.h"
#include "engine/io/error.h"
#include "engine/io/text.h"
#include "engine/run/picture_file.h"

namespace app {
namespace {

struct ServeArguments {
    ScenarioChoice scenario;
    std::string cache;
    std::vector<std::string> set;
    int keep = 10'000;
    bool schema = false;
};

constexpr std::size_t longest_line = 1'000'000;  // [bytes]
constexpr int most_frames = 100'000;             // of one step

/// A line of the input without its end. A longer one than the longest is not kept: its rest is left in the
/// stream, and `too_long` says so.
bool take_line(std::istream& input, std::string& line, bool& too_long) {
    line.clear();
    too_long = false;
    for (char c; input.get(c);) {
        if (c == '\n') return true;
        if (line.size() == longest_line) {
            too_long = true;
            return true;
        }
        line += c;
    }
    return !line.empty() && input.eof();
}

void skip_line(std::istream& input) {
    for (char c; !stop_requested() && input.get(c) && c != '\n';) continue;
}

/// Answers lines for one episode.
class Server {
public:
    Server(episode::Episode& episode, int most_kept) : episode_(episode), most_kept_(most_kept) {}

    /// What a line asks for besides a command of scripts; empty where it is none of these.
    std::string answer(const std::string& line) {
        const auto word = line.substr(0, line.find(' '));
        const std::string rest = word.size() < line.size() ? line.substr(word.size() + 1) : std::string();
        const bool alone =
            word == "state" || word == "restart" || word == "keep" || word == "score" || word == "quit";
        if (alone && !rest.empty())
            throw io::InputError("'{}': expected '{}' alone, found '{}' after it", line, word, rest);
        if (word == "step") step(line, rest);
        if (word == "restart") episode_.reset();
        if (word == "back") episode_.restore(kept_[number_of(line, rest)]);
        if (word == "step" || word == "state" || word == "restart" || word == "back")
            return episode::to_json(episode_);
        if (word == "keep") return keep();
        if (word == "image") return image(line, rest);
        if (word == "save") {
            if (rest.empty())
                throw io::InputError("'{}': expected the name of a file after it, found none", word);
            episode_.save(rest, origin());
            return fmt::format("{{\"saved\":{}}}", episode::quoted(rest));
        }
        if (word == "score") return episode::score_line(episode_, program);
        return {};
    }

private:
    /// That many frames; the commands since the last one belong to the first.
    void step(const std::string& line, const std::string& rest) {
        const std::optional<int> frames = rest.empty() ? 1 : io::parse_integer(rest);
        if (!frames || *frames < 1 || *frames > most_frames)
            throw io::InputError("'{}': expected 'step', or 'step' with a number of frames from 1 to {}",
                                 line, most_frames);
        for (int k = 0; k < *frames && !stop_requested(); ++k) episode_.step({});
    }
    std::size_t number_of(const std::string& line, const std::string& rest) const {
        const std::optional<int> number = io::parse_integer(rest);
        if (!number || *number < 0 || *number >= static_cast<int>(kept_.size()))
            throw io::InputError("'{}': expected the number of a state that was kept, below {}", line,
                                 kept_.size());
        return static_cast<std::size_t>(*number);
    }
    std::string keep() {
        if (static_cast<int>(kept_.size()) >= most_kept_)
            throw io::InputError(
                "'keep': expected at most {} kept states, found one more; serve --keep NUMBER sets another "
                "limit",
                most_kept_);
        kept_.push_back(episode_.snapshot());
        return fmt::format("{{\"kept\":{}}}", kept_.size() - 1);
    }
    std::string image(const std::string& line, const std::string& rest) {
        const std::size_t space = rest.find(' ');
        const std::optional<int> pixels = io::parse_integer(rest.substr(0, space));
        if (!pixels || space == std::string::npos)
            throw io::InputError("'{}': expected 'image PIXELS FILE.png'", line);
        const std::string file = rest.substr(space + 1);
        episode_.require_no_input("image", file);
        run::write_picture(file, episode_.image(*pixels, episode::ImageMode::Live));
        return fmt::format("{{\"image\":{}}}", episode::quoted(file));
    }

    episode::Episode& episode_;
    const int most_kept_;
    std::vector<episode::Episode::Snapshot> kept_;
};

int serve(const ServeArguments& arguments) {
    if (arguments.schema) {
        write_out(episode::schema_of_lines() + "\n");
        return done;
    }
    anatomy::ModelCache cache;
    cache.folder = usual_cache(arguments.cache);
    std::unique_ptr<episode::Episode> episode;
    {
        ProgressBar bar;
        report_on(bar, cache);
        episode = std::make_unique<episode::Episode>(scenario_named(arguments.scenario, arguments.set),
                                                     exercise::Pictures::None, cache);
    }
    Server server(*episode, arguments.keep);
    const auto say = [](const std::string& line) {
        write_out(line + "\n");
        if (std::fflush(stdout) != 0) write_out({});
    };
    say(episode::to_json(*episode));
    const auto refuse = [&say](const std::string& why) {
        say(fmt::format("{{\"error\":{}}}", episode::quoted(why)));
    };
    bool too_long = false;
    for (std::string line; !stop_requested() && take_line(std::cin, line, too_long);) {
        if (stop_requested()) break;  // the line may be cut
        if (too_long) {
            refuse(fmt::format("expected a line of at most {} bytes, found a longer one", longest_line));
            skip_line(std::cin);
            continue;
        }
        if (!line.empty() && line.back() == '\r') line.pop_back();
        if (line == "quit") break;
        if (line.empty() || line.front() == '#') continue;
        try {
            const std::string said = server.answer(line);
            // A command of scripts waits for the step.
            if (said.empty()) {
                episode->ask(episode::parse_line(line));
                continue;
            }
            say(said);
        } catch (const io::InputError& error) {
            refuse(error.what());
        }
    }
    return stop_requested() ? interrupted : done;
}

}  // namespace

Command add_serve(CLI::App& parser) {
    const auto arguments = std::make_shared<ServeArguments>();
    CLI::App* command = parser.add_subcommand(
        "serve",
        "An exercise for a program in any language: commands on standard input, states as JSON lines\n\n"
        "Examples:\n"
        "  seldinger serve renal\n"
        "  printf 'advance 5 mm\\nstep 10\\n' | seldinger serve straight\n"
        "  seldinger serve straight --schema");
    add_scenario(command, arguments->scenario);
    add_patient(command, arguments->scenario);
    add_overrides(command, arguments->set);
    add_cache_folder(command, arguments->cache);
    command->add_option("--keep", arguments->keep, "The most states that 'keep' keeps, each of 30 to 100 kB")
        ->check(whole_number(1, 1'000'000))
        ->capture_default_str();
    command->add_flag("--schema", arguments->schema, "Prints the JSON Schema of the answers, and ends");
    command->footer(
        "Lines:\n"
        "  advance 2 mm, rotate 30 deg, ...   a command of scripts; it waits for the step and is not "
        "answered\n"
        "  step, step NUMBER                  makes a frame with the commands since the last one, or more "
        "frames\n"
        "  state, restart                     the state as it is; the start again, bit for bit\n"
        "  keep, back NUMBER                  keeps the state and says its number; goes back to it\n"
        "  image PIXELS FILE.png, save FILE.gw, score, quit\n"
        "Each but a command of scripts is answered by one line of JSON: the state after it (lengths in mm, "
        "forces\n"
        "in N; null where there is no way to the target), or {\"error\": why}, and then nothing was "
        "changed.\n"
        "The first line is the state before any step.\n"
        "Exit codes: 0 end of input or quit, 2 bad scenario, 130 interrupted.");
    return {command, [arguments] { return serve(*arguments); }};
}

}  // namespace app
