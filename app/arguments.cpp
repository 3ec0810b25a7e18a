#include "app/arguments.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <sstream>
#include <string_view>

#include "app/command.h"
#include "engine/io/text.h"

namespace app {

namespace {

std::vector<std::string> given;

constexpr double unbounded = std::numeric_limits<double>::infinity();
constexpr std::int64_t any_whole = std::numeric_limits<int>::min();
constexpr std::int64_t largest_seed = 9'000'000'000'000'000;
constexpr std::string_view between_words = "|";

/// The last command that was given.
const CLI::App& chosen(const CLI::App& app) {
    const CLI::App* at = &app;
    while (!at->get_subcommands().empty()) at = at->get_subcommands().front();
    return *at;
}

std::vector<std::string> commands_below(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::App* one : app.get_subcommands([](const CLI::App*) { return true; }))
        names.push_back(one->get_name());
    return names;
}

/// "a, b or c".
std::string either(std::vector<std::string> words, std::string_view last) {
    if (words.size() == 1) return words.front();
    const std::string end = words.back();
    words.pop_back();
    return fmt::format("{} {} {}", io::joined(words), last, end);
}

/// "did you mean" of owned words.
std::string near_to(const std::string& written, const std::vector<std::string>& accepted) {
    return io::suggestion(written, std::vector<std::string_view>(accepted.begin(), accepted.end()));
}

std::vector<std::string> names_of(const CLI::Option& option) {
    std::vector<std::string> names;
    for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option.get_snames()) names.push_back("-" + name);
    return names;
}

bool is_flag(const CLI::Option& option) {
    return option.get_items_expected_max() == 0;
}

bool is_repeated(const CLI::Option& option) {
    return option.get_expected_max() >= CLI::detail::expected_max_vector_size;
}

/// "--out FOLDER", "scenario".
std::string shown(const CLI::Option& option) {
    const std::string name = option.get_name();
    return is_flag(option) || option.get_positional() ? name : name + " " + kind_of(option);
}

/// Begins what a validator says of itself, after the kind of value.
constexpr std::string_view range_mark = ":[";

/// "1 to 256".
std::string range_of(const CLI::Option& option) {
    const std::string type = option.get_type_name();
    const std::size_t mark = type.find(range_mark);
    return mark == std::string::npos ? "" : type.substr(mark + 2, type.size() - mark - 3);
}

std::string in_brackets(const std::string& range) {
    return range.empty() ? range : "[" + range + "]";
}

std::string from(const std::string& range) {
    return range.empty() ? range : " from " + range;
}

/// What is said of an option after what is wrong with it.
std::string explained(const CLI::Option& option) {
    return fmt::format("\n  {}: {}", shown(option), option.get_description());
}

std::string unknown_word(const CLI::App& app, const std::vector<std::string>& rest) {
    const auto is_option = [](const std::string& word) {
        return word.size() > 1 && word.front() == '-' && !io::parse_number(word);
    };
    const auto option = std::find_if(rest.begin(), rest.end(), is_option);
    const std::vector<std::string> commands = commands_below(app);
    if (option != rest.end() && (option == rest.begin() || commands.empty())) {
        const std::string name = option->substr(0, option->find('='));
        std::vector<std::string> known;
        for (const CLI::Option* one : app.get_options())
            for (const std::string& other : names_of(*one)) known.push_back(other);
        return fmt::format("unknown option '{}'{}", name, near_to(name, known));
    }
    if (!commands.empty())
        return fmt::format("'{}' is not a command{}; commands are: {}", rest.front(),
                           near_to(rest.front(), commands), io::joined(commands));
    return fmt::format("expected no more arguments, found '{}'", rest.front());
}

/// The option that a message of CLI11 names first.
const CLI::Option* named_in(const std::string& message, const CLI::App& app) {
    const CLI::Option* best = nullptr;
    std::pair<std::size_t, std::size_t> first{std::string::npos, 0};
    for (const CLI::Option* option : app.get_options()) {
        std::vector<std::string> names = option->get_lnames();
        names.insert(names.end(), option->get_snames().begin(), option->get_snames().end());
        if (option->get_positional()) names.push_back(option->get_name(true));
        for (const std::string& name : names)
            for (std::size_t at = message.find(name); at != std::string::npos;
                 at = message.find(name, at + 1)) {
                const auto of_name = [&](std::size_t k) {
                    return k < message.size() && (std::isalnum(static_cast<unsigned char>(message[k])) != 0 ||
                                                  message[k] == '-' || message[k] == '_');
                };
                const bool starts = at == 0 || message[at - 1] == '-' || !of_name(at - 1);
                if (!starts || of_name(at + name.size())) continue;
                // The first, and of names that begin there the longest.
                const std::pair place{at, std::string::npos - name.size()};
                if (place < first) first = place, best = option;
                break;
            }
    }
    return best;
}

std::string wrong_number_of_values(const CLI::Option& option) {
    const std::size_t found = option.results().size(),
                      each = static_cast<std::size_t>(std::max(1, option.get_items_expected_min()));
    const std::string name = option.get_name(),
                      expected = fmt::format("{}: expected {}, found", name, kind_of(option));
    if (is_flag(option)) return name + ": expected no value, found one";
    if (found == 0) return expected + " nothing" + explained(option);
    if (each == 1) return fmt::format("{}: expected it once, found it {} times", name, found);
    return fmt::format("{} {}{} values", expected, found, found < each ? fmt::format(" of {}", each) : "") +
           explained(option);
}

/// What CLI11 lets pass: the name of an option as a value, which is then a forgotten one, and too few values
/// at an option that takes several each time. Empty where there is none.
std::string passed_values(const CLI::App& command) {
    const std::vector<const CLI::Option*> options = command.get_options();
    const auto is_option = [&](const std::string& word) {
        return word.starts_with("--") && std::ranges::any_of(options, [&](const CLI::Option* option) {
                   return std::ranges::count(names_of(*option), word.substr(0, word.find('='))) > 0;
               });
    };
    for (const CLI::Option* option : options) {
        if (is_flag(*option)) continue;
        for (const std::string& word : option->results())
            if (is_option(word))
                return fmt::format("{}: expected {}, found the option '{}'", option->get_name(),
                                   kind_of(*option), word) +
                       explained(*option);
        const auto each = static_cast<std::size_t>(std::max(1, option->get_items_expected_min()));
        if (option->results().size() % each != 0) return wrong_number_of_values(*option);
    }
    return {};
}

/// What is wrong, without the command's name.
std::string wrong_with(const CLI::App& command, const CLI::ParseError& error) {
    const std::vector<const CLI::Option*> options = command.get_options();
    if (dynamic_cast<const CLI::ValidationError*>(&error) != nullptr) return error.what();
    if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr ||
        dynamic_cast<const CLI::ConversionError*>(&error) != nullptr)
        if (const CLI::Option* option = named_in(error.what(), command))
            return wrong_number_of_values(*option);
    std::vector<std::string> missing;
    std::string more;
    for (const CLI::Option* option : options) {
        if (option->get_required() && option->count() == 0) {
            missing.push_back(shown(*option));
            more += explained(*option);
        }
        if (option->count() == 0) continue;
        for (const CLI::Option* other : option->get_needs())
            if (other->count() == 0)
                return fmt::format("{}: expected {} with it, found none", option->get_name(), shown(*other));
        for (const CLI::Option* other : option->get_excludes())
            if (other->count() > 0)
                return fmt::format("{}: expected it without {}, found both", option->get_name(),
                                   other->get_name());
    }
    if (!missing.empty())
        return fmt::format("{} {} missing", either(missing, "and"), missing.size() > 1 ? "are" : "is") + more;
    if (command.get_require_subcommand_min() > 0 && command.get_subcommands().empty())
        return fmt::format("expected a command, found none; commands are: {}",
                           io::joined(commands_below(command)));
    return "expected other arguments";
}

/// What is wrong with the words that were read, and what the library says of them; empty where nothing is.
std::string refusal_of(const CLI::App& root, const CLI::ParseError* error) {
    const CLI::App* at = &root;
    while (true) {
        if (const std::string wrong = passed_values(*at); !wrong.empty()) return refusal(*at, wrong);
        if (const auto rest = at->remaining(); !rest.empty()) return refusal(*at, unknown_word(*at, rest));
        if (at->get_subcommands().empty()) break;
        at = at->get_subcommands().front();
    }
    return error ? refusal(*at, wrong_with(*at, *error)) : std::string();
}

/// `text` in lines of at most `width` columns, of which those after the first begin with `indent` blanks, and
/// none with an option's name.
std::string wrapped(const std::string& text, std::size_t width, std::size_t indent) {
    std::string made;
    std::size_t column = 0;
    for (const std::string_view word : io::words_of(text)) {
        const auto wide = static_cast<std::size_t>(
            std::count_if(word.begin(), word.end(), [](char c) { return (c & 0xC0) != 0x80; }));
        if (column > 0 && column + 1 + wide > width && !word.starts_with("-")) {
            made += "\n" + std::string(indent, ' ');
            column = 0;
        } else if (column > 0) {
            made += " ";
            ++column;
        }
        made += word;
        column += wide;
    }
    return made;
}

/// Help: what the command is for, examples, usage, arguments, options.
class Help : public CLI::Formatter {
public:
    std::string make_help(const CLI::App* app, std::string, CLI::AppFormatMode) const override {
        std::string text = app->get_description() + "\n\n" + usage(*app) + "\n";
        section(text, "Arguments", *app, true);
        section(text, "Options", *app, false);
        std::string group;
        for (const CLI::App* one : app->get_subcommands([](const CLI::App*) { return true; })) {
            const std::string of = one->get_group() == "Subcommands" ? "Commands" : one->get_group();
            if (of != group) text += "\n" + of + ":\n";
            group = of;
            entry(text, one->get_name(), summary_of(*one), app->get_parent() == nullptr ? 14 : indent);
        }
        if (!app->get_footer().empty()) text += "\n" + app->get_footer() + "\n";
        return text;
    }

private:
    static constexpr std::size_t indent = 26, width = 100;

    static std::string usage(const CLI::App& app) {
        std::string text = "Usage: " + path_of(app);
        for (const CLI::Option* option : app.get_options()) {
            std::string word = shown(*option);
            if (option->get_positional() && is_repeated(*option)) word += "...";
            if (option->get_required()) text += " " + word;
            if (!option->get_required() && option->get_positional()) text += " [" + word + "]";
        }
        if (app.get_require_subcommand_min() > 0) text += " COMMAND";
        return text + " [OPTION]...";
    }
    static void entry(std::string& text, const std::string& left, const std::string& right,
                      std::size_t column) {
        text += "  " + left;
        if (left.size() + 4 > column)
            text += "\n" + std::string(column, ' ');
        else
            text += std::string(column - 2 - left.size(), ' ');
        text += wrapped(right, width - column, column) + "\n";
    }
    static void section(std::string& text, const char* heading, const CLI::App& app, bool positional) {
        std::string entries;
        for (const CLI::Option* option : app.get_options()) {
            if (option->get_positional() != positional) continue;
            std::string left = positional ? option->get_name(true) : option->get_name(false, true);
            if (!positional && !is_flag(*option)) left += " " + kind_of(*option);
            if (is_repeated(*option)) left += "...";
            std::string right = option->get_description();
            if (const std::string range = range_of(*option); !range.empty() && words_of(*option).empty())
                right += " [" + range + "]";
            if (!option->get_default_str().empty()) right += "; else " + option->get_default_str();
            if (option->get_required() && !positional) right += " (required)";
            entry(entries, left, right, indent);
        }
        if (!entries.empty()) text += fmt::format("\n{}:\n", heading) + entries;
    }
};

/// What all commands have in common.
void prepare(CLI::App& app) {
    app.formatter(std::make_shared<Help>());
    app.set_help_flag("-h,--help", "This help");
    app.set_version_flag("-V,--version", program, "The program's version");
    for (CLI::Option* option : app.get_options()) {
        if (is_flag(*option)) {
            option->disable_flag_override();
            continue;
        }
        const std::string type = option->get_type_name();
        const std::string kind = type.substr(0, type.find(range_mark));
        if (kind != "UINT" && kind != "INT" && kind != "FLOAT") continue;
        if (kind == type)  // it is not held to a range
            option->check(kind == "FLOAT"  ? number()
                          : kind == "UINT" ? whole_number(0, largest_seed)
                                           : whole_number(any_whole, std::numeric_limits<int>::max()));
        option->type_name("NUMBER");
    }
    for (CLI::Option* option : app.get_options())
        if (!option->get_positional() && is_repeated(*option)) option->allow_extra_args(false);
    for (CLI::App* below : app.get_subcommands({})) prepare(*below);
}

}  // namespace

CLI::Validator whole_number(std::int64_t least, std::int64_t most) {
    const std::string range = least == any_whole ? "" : fmt::format("{} to {}", least, most);
    return {[=](std::string& word) -> std::string {
                const std::string_view digits = std::string_view(word).substr(word.starts_with('-'));
                const bool decimal =
                    !digits.empty() && digits.find_first_not_of("0123456789") == std::string_view::npos;
                const bool plain = decimal && (digits.size() == 1 || digits.front() != '0');
                if (plain && digits.size() <= 18 && std::stoll(word) >= least && std::stoll(word) <= most)
                    return {};
                return fmt::format("expected a whole number{}{}, found '{}'", from(range),
                                   decimal && !plain ? " without leading zeros" : "", word);
            },
            in_brackets(range)};
}

CLI::Validator number(double least, double most) {
    const std::string range = least == -unbounded ? "" : fmt::format("{:g} to {:g}", least, most);
    return {[=](std::string& word) -> std::string {
                const std::optional<double> read = io::parse_number(word);
                if (read && std::isfinite(*read) && *read >= least && *read <= most) return {};
                return fmt::format("expected a number{}, found '{}'", from(range), word);
            },
            in_brackets(range)};
}

CLI::Validator one_of(const std::vector<std::string>& accepted) {
    return {[=](std::string& word) -> std::string {
                if (std::ranges::count(accepted, word) > 0) return {};
                return fmt::format("expected {}, found '{}'{}", either(accepted, "or"), word,
                                   near_to(word, accepted));
            },
            in_brackets(io::joined(accepted, between_words))};
}

CLI::Validator text_that(const std::function<bool(const std::string&)>& good, const std::string& expected) {
    return {[=](std::string& word) -> std::string {
                if (good(word)) return {};
                return fmt::format("expected {}, found '{}'", expected, word);
            },
            ""};
}

CLI::Validator key_and_value() {
    return text_that(
        [](const std::string& word) { return word.find('=') != std::string::npos && word.front() != '='; },
        "KEY=VALUE");
}

CLI::Validator picture_name() {
    return text_that(
        [](const std::string& word) { return std::filesystem::path(word).extension() == ".png"; },
        "a file name that ends in .png");
}

CLI::Validator shard() {
    return text_that(
        [](const std::string& word) {
            try {
                static_cast<void>(io::parse_shard(word));
                return true;
            } catch (const io::InputError&) {
                return false;
            }
        },
        fmt::format("i/n with i from 1 to n, and n up to {}", io::most_shards));
}

std::optional<int> parse(CLI::App& parser, int count, char** values) {
    given.assign(values + std::min(count, 1), values + count);
    prepare(parser);
    std::string wrong;
    try {
        parser.parse(count, values);
        wrong = refusal_of(parser, nullptr);
    } catch (const CLI::CallForVersion&) {
        print("{}\n", program);
        return done;
    } catch (const CLI::ParseError& error) {
        const CLI::App& command = chosen(parser);
        // Whoever asks for help gets it, whatever else is wrong.
        if (command.get_help_ptr()->count() > 0) {
            print("{}", command.help());
            return done;
        }
        wrong = refusal_of(parser, &error);
    }
    if (wrong.empty()) return std::nullopt;
    tell("{}\n", wrong);
    return bad_input;
}

const std::vector<std::string>& given_words() {
    return given;
}

std::string refusal(const CLI::App& app, const std::string& text) {
    const CLI::App& command = chosen(app);
    const std::string path = path_of(command);
    const std::size_t line = text.find('\n');
    return fmt::format("{}: {} ('{} --help'){}", path, text.substr(0, line), path,
                       line == std::string::npos ? "" : text.substr(line));
}

std::string path_of(const CLI::App& app) {
    return app.get_parent() == nullptr ? app.get_name() : path_of(*app.get_parent()) + " " + app.get_name();
}

std::string summary_of(const CLI::App& app) {
    const std::string text = app.get_description();
    return text.substr(0, text.find('\n'));
}

std::string kind_of(const CLI::Option& option) {
    if (is_flag(option)) return {};
    if (const std::vector<std::string> accepted = words_of(option); !accepted.empty())
        return io::joined(accepted, between_words);
    const std::string type = option.get_type_name();
    return type.substr(0, type.find(range_mark));
}

std::vector<std::string> words_of(const CLI::Option& option) {
    std::vector<std::string> accepted;
    if (const std::string range = range_of(option); range.find(between_words) != std::string::npos)
        for (const std::string_view word : io::split(range, between_words.front()))
            accepted.emplace_back(word);
    return accepted;
}

}  // namespace app
