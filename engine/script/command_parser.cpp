#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/script/command.h"
#include "physics/geometry/vec.h"
#include "render/xray/materials.h"

namespace script {
namespace {

constexpr std::size_t most_commands = 2'000'000;
constexpr std::size_t most_messages = 20;
constexpr std::size_t most_comments = 10'000;

constexpr std::array<std::string_view, 6> arm_words = {"lao", "cranial", "sid", "sod", "width", "isocentre"};

struct Word {
    std::string_view text;
    int column = 1;
};

struct Refusal {
    int column;
    std::string message;
};

/// The words of one line, taken from the left; every function that takes one states what it accepts.
class Line {
public:
    explicit Line(std::string_view text) {
        text = text.substr(0, text.find('#'));
        length_ = static_cast<int>(text.size());
        for (std::size_t i = 0; i < text.size();) {
            if (is_space(text[i])) {
                ++i;
                continue;
            }
            std::size_t end = i;
            while (end < text.size() && !is_space(text[end])) ++end;
            words_.push_back({text.substr(i, end - i), static_cast<int>(i) + 1});
            i = end;
        }
    }

    bool done() const { return next_ == words_.size(); }
    const Word& take(const std::string& accepted) {
        if (done()) throw Refusal{length_ + 1, fmt::format("the line ends here; {}", accepted)};
        return words_[next_++];
    }
    [[noreturn]] static void refuse(const Word& word, const std::string& accepted) {
        throw Refusal{word.column, fmt::format("'{}' was found; {}", word.text, accepted)};
    }
    double number(double least, double most, std::string_view unit) {
        const std::string accepted = fmt::format("expected a number from {} to {}, in {}", least, most, unit);
        const Word& word = take(accepted);
        const std::optional<double> read = io::parse_number(word.text);
        if (read && *read >= least && *read <= most) return *read;  // NaN is not
        if (const std::string_view amount = word.text.substr(0, word.text.size() - unit.size());
            word.text.ends_with(unit) && io::parse_number(amount))
            refuse(word, fmt::format("expected a space in it: '{} {}'", amount, unit));
        refuse(word, accepted);
    }
    /// Takes the word if it is this one.
    bool next_is(std::string_view text) {
        const bool is = !done() && words_[next_].text == text;
        next_ += is;
        return is;
    }
    void unit(std::string_view accepted) {
        if (done())
            throw Refusal{length_ + 1,
                          fmt::format("the unit is missing: '{} {}'", words_[next_ - 1].text, accepted)};
        exactly(accepted, fmt::format("expected the unit '{}'", accepted));
    }
    void word(std::string_view accepted) { exactly(accepted, fmt::format("expected '{}'", accepted)); }
    double amount(double least, double most, std::string_view accepted) {
        const double value = number(least, most, accepted);
        unit(accepted);
        return value;
    }
    double amount(render::ArmLimits::Range range, std::string_view accepted) {
        return amount(range.least, range.most, accepted);
    }
    /// Takes one of the words and returns its place among them.
    std::size_t choice(std::span<const std::string_view> words, const std::string& accepted) {
        const Word& word = take(accepted);
        const auto found = std::ranges::find(words, word.text);
        if (found == words.end()) refuse(word, accepted);
        return static_cast<std::size_t>(found - words.begin());
    }
    bool either(std::string_view yes, std::string_view no) {
        return choice(std::array{yes, no}, fmt::format("expected '{}' or '{}'", yes, no)) == 0;
    }
    void finish() const {
        if (!done()) refuse(words_[next_], "expected the end of the line");
    }

private:
    void exactly(std::string_view accepted, const std::string& text) {
        const Word& found = take(text);
        if (found.text != accepted) refuse(found, text);
    }
    static bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r'; }
    std::vector<Word> words_;
    std::size_t next_ = 0;
    int length_ = 0;
};

int frame_number(const Word& word, std::string_view text) {
    const std::optional<int> frame = io::parse_integer(text);
    if (!frame || *frame < 0 || *frame > largest_frame) {
        Line::refuse(word,
                     fmt::format("expected a frame number from 0 to {}, or FIRST..LAST", largest_frame));
    }
    return *frame;
}

MoveArm arm_command(Line& line) {
    using Limits = render::ArmLimits;
    constexpr double reach = Limits::isocentre;
    MoveArm move;
    do {
        const std::string accepted = "expected " + io::joined(arm_words);
        const Word& word = line.take(accepted);
        if (word.text == "lao")
            move.lao = line.amount(Limits::lao, "deg") * geometry::degree;
        else if (word.text == "cranial")
            move.cranial = line.amount(Limits::cranial, "deg") * geometry::degree;
        else if (word.text == "sid")
            move.sid = line.amount(Limits::sid, "mm");
        else if (word.text == "sod")
            move.sod = line.amount(Limits::sod, "mm");
        else if (word.text == "width")
            move.detector_width = line.amount(Limits::detector_width, "mm");
        else if (word.text == "isocentre") {
            const double x = line.number(-reach, reach, "mm"), y = line.number(-reach, reach, "mm");
            move.isocentre = geometry::Vec3(x, y, line.amount(-reach, reach, "mm"));
        } else
            Line::refuse(word, accepted);
    } while (!line.done());
    return move;
}

/// The device of a motion: the wire where the line names none.
DeviceRole held(Line& line) {
    for (const std::string_view name : role_names)
        if (line.next_is(name)) return *role_named(name);
    return line.next_is("both") ? DeviceRole::All : DeviceRole::Wire;
}

/// A device by its name, from the list's `first` on.
DeviceRole device(Line& line, std::size_t first = 0) {
    const auto names = device_names().subspan(first);
    return *role_named(names[line.choice(names, "expected one of: " + io::joined(names))]);
}

Inject inject_command(Line& line) {
    Inject inject;
    inject.volume = line.amount(0.1, largest_volume, "ml");
    line.word("at");
    inject.rate = line.amount(0.1, render::largest_flow, "ml/s");
    if (line.next_is("through")) {
        inject.introducer = line.next_is("introducer");
        if (!inject.introducer) inject.through = device(line, 1);  // a wire has no lumen
    } else {
        const Word& word = line.take("expected 'into' with a branch, or 'through catheter'");
        if (word.text != "into") Line::refuse(word, "expected 'into' with a branch, or 'through catheter'");
        inject.branch = line.take("expected the name of a branch").text;
    }
    if (!line.done()) {
        line.word("of");
        inject.iodine = line.amount(1, render::largest_iodine, "mg/ml");
    }
    return inject;
}

Exchange exchange_command(Line& line) {
    constexpr std::array<std::string_view, 2> changed = {"wire", "balloon"};
    const DeviceRole held = *role_named(changed[line.choice(changed, "expected 'wire' or 'balloon'")]);
    return {std::string(line.take("expected the name of a device of the catalogue, or its file").text), held};
}

SetPulseRate pulse_command(Line& line) {
    const std::string accepted = "expected " + pulse_rates_text() + ", per second";
    const Word& word = line.take(accepted);
    const std::optional<double> rate = io::parse_number(word.text);
    if (!rate || !is_pulse_rate(*rate)) Line::refuse(word, accepted);
    line.word("per");
    line.word("second");
    return {*rate};
}

SetMode mode_command(Line& line) {
    return {static_cast<ImagingMode>(line.choice(imaging_modes, "expected " + io::joined(imaging_modes)))};
}

Collimate collimate_command(Line& line) {
    if (line.next_is("open")) return {widest_opening, widest_opening};
    const double width = line.number(10, widest_opening, "mm");
    return {width, line.amount(10, widest_opening, "mm")};
}

SetFilter filter_command(Line& line) {
    SetFilter set;
    set.kind = static_cast<FilterKind>(line.choice(filter_names, "expected " + io::joined(filter_names)));
    if (line.next_is("out")) return set;
    set.place.edge = line.amount(-farthest_filter, farthest_filter, "mm");
    set.place.angle = line.amount(-360, 360, "deg") * geometry::degree;
    return set;
}

MoveTable table_command(Line& line) {
    const double x = line.number(-table_reach.x(), table_reach.x(), "mm");
    const double y = line.number(-table_reach.y(), table_reach.y(), "mm");
    return {geometry::Vec3(x, y, line.amount(-table_reach.z(), table_reach.z(), "mm"))};
}

ShiftMask shift_command(Line& line) {
    if (line.next_is("auto")) return {ShiftMask::Mode::Auto};
    if (line.next_is("off")) return {};
    ShiftMask shift;
    if (line.next_is("by")) shift.mode = ShiftMask::Mode::By;
    const std::string accepted = fmt::format(
        "expected {}two numbers from {} to {}, in pixels to the right and down",
        shift.mode == ShiftMask::Mode::To ? "'auto', 'off' or " : "", -largest_shift, largest_shift);
    for (double* const offset : {&shift.x, &shift.y}) {
        const Word& word = line.take(accepted);
        const std::optional<double> read = io::parse_number(word.text);
        if (!read || !(std::abs(*read) <= largest_shift)) Line::refuse(word, accepted);  // also rejects NaN
        *offset = *read;
    }
    if (!line.done()) line.unit("px");
    return shift;
}

/// "of LRA", or "in LRA" for a thrombus.
std::string branch_of(Line& line, ComplicationKind kind) {
    line.word(preposition(kind));
    return std::string(line.take("expected the name of a branch").text);
}

Complicate complication_command(Line& line) {
    Complicate set;
    set.kind = static_cast<ComplicationKind>(
        line.choice(complication_names, "expected " + io::joined(complication_names)));
    if (set.kind == ComplicationKind::Breath) {
        set.breath =
            static_cast<BreathManner>(line.choice(breath_manners, "expected " + io::joined(breath_manners)));
        return set;
    }
    const bool spasm = set.kind == ComplicationKind::Spasm, thrombus = set.kind == ComplicationKind::Thrombus;
    set.branch = branch_of(line, set.kind);
    line.word("at");
    set.at = line.amount(0, largest_place, "mm");
    set.over = thrombus_length;
    if (!thrombus || !line.done()) {
        line.word("over");
        set.over = line.amount(shortest_complication, longest_complication, "mm");
    }
    set.percent = thrombus ? 100 : dissection_percent;
    if (spasm || (!thrombus && !line.done())) {
        line.word("by");
        set.percent = line.amount(least_narrowing, largest_narrowing, "percent");
    }
    return set;
}

Relieve relieve_command(Line& line) {
    if (line.next_is("all")) return {};
    const auto of_branches = std::span(complication_names).first(3);
    Relieve relieve;
    relieve.kind = static_cast<ComplicationKind>(
        line.choice(of_branches, "expected " + io::joined(of_branches) + ", all"));
    relieve.branch = branch_of(line, *relieve.kind);
    return relieve;
}

/// A verb, and how the rest of its line is read.
struct Verb {
    std::string_view word;
    Command (*read)(Line&);
};
constexpr Verb verbs[] = {
    {"advance",
     [](Line& l) -> Command {
         const DeviceRole device = held(l);
         return Advance{l.amount(0, largest_motion, "mm"), device};
     }},
    {"withdraw",
     [](Line& l) -> Command {
         const DeviceRole device = held(l);
         return Withdraw{l.amount(0, largest_motion, "mm"), device};
     }},
    {"rotate",
     [](Line& l) -> Command {
         const DeviceRole device = held(l);
         return Rotate{l.amount(-largest_rotation, largest_rotation, "deg") * geometry::degree, device};
     }},
    {"grip",
     [](Line& l) -> Command {
         const DeviceRole held = device(l);
         return Grip{l.amount(least_grip, largest_grip, "mm"), held};
     }},
    {"pin",
     [](Line& l) -> Command {
         const DeviceRole held = device(l);
         return Pin{l.either("on", "off"), held};
     }},
    {"teacher",
     [](Line& l) -> Command {
         using Thing = TeacherAct::Thing;
         if (l.next_is("paused")) return TeacherAct{Thing::Paused};
         const auto thing = l.choice(teacher_things, "expected paused, " + io::joined(teacher_things));
         return TeacherAct{static_cast<Thing>(thing), l.either("on", "off")};
     }},
    {"remove", [](Line& l) -> Command { return Remove{device(l)}; }},
    {"exchange", [](Line& l) -> Command { return exchange_command(l); }},
    {"arm", [](Line& l) -> Command { return arm_command(l); }},
    {"beam", [](Line& l) -> Command { return Beam{l.either("on", "off")}; }},
    {"contrast", [](Line& l) -> Command { return Contrast{l.amount(0, render::largest_iodine, "mg/ml")}; }},
    {"inject", [](Line& l) -> Command { return inject_command(l); }},
    {"mode", [](Line& l) -> Command { return mode_command(l); }},
    {"pulse", [](Line& l) -> Command { return pulse_command(l); }},
    {"mask", [](Line&) -> Command { return NewMask{}; }},
    {"shift", [](Line& l) -> Command { return shift_command(l); }},
    {"breath", [](Line& l) -> Command { return Breathe{l.either("hold", "free")}; }},
    {"collimate", [](Line& l) -> Command { return collimate_command(l); }},
    {"filter", [](Line& l) -> Command { return filter_command(l); }},
    {"table", [](Line& l) -> Command { return table_command(l); }},
    {"reference", [](Line&) -> Command { return StoreReference{}; }},
    {"reset", [](Line&) -> Command { return Reset{}; }},
    {"complication", [](Line& l) -> Command { return complication_command(l); }},
    {"relieve", [](Line& l) -> Command { return relieve_command(l); }},
    {"inflate", [](Line& l) -> Command { return Inflate{l.amount(0, largest_inflation, "atm")}; }},
    {"deflate", [](Line&) -> Command { return Deflate{}; }},
    {"deploy", [](Line&) -> Command { return Deploy{}; }},
    {"retrieve",
     [](Line& l) -> Command {
         l.word("sheath");
         return RetrieveSheath{l.amount(0, largest_motion, "mm")};
     }},
};
static_assert(std::size(verbs) == std::variant_size_v<Command>, "every command has its verb");

/// All verbs, and 'end', which is not a command.
std::vector<std::string_view> known_verbs() {
    std::vector<std::string_view> words;
    for (const Verb& verb : verbs) words.push_back(verb.word);
    words.push_back("end");
    return words;
}

Command command(const Word& word, Line& line) {
    for (const Verb& verb : verbs)
        if (verb.word == word.text) return verb.read(line);
    const std::vector<std::string_view> known = known_verbs();
    // What these are called elsewhere.
    constexpr std::pair<std::string_view, std::string_view> others[] = {
        {"push", "advance"},     {"forward", "advance"}, {"pull", "withdraw"},
        {"retract", "withdraw"}, {"turn", "rotate"},     {"torque", "rotate"}};
    const std::string typed = io::lower_case(word.text);
    const auto* const other = std::ranges::find(others, typed, [](const auto& pair) { return pair.first; });
    throw Refusal{word.column,
                  fmt::format("unknown command '{}'{}; commands are: {}", word.text,
                              io::suggestion(other != std::end(others) ? other->second : word.text, known),
                              io::joined(known))};
}

class Parser {
public:
    explicit Parser(const std::string& file) { script_.file = file; }

    void read(std::string_view text, int number) {
        place_ = {script_.file, number, 1};
        try {
            if (signed_)
                throw Refusal{1, "the line before is a recording's signature; expected nothing after it"};
            if (signature(text)) return;
            if (header(text, number)) return;
            if (text.starts_with("#")) return comment(text.substr(1));
            if (text.starts_with("comment ")) return remark(text);
            Line line(text);
            if (line.done()) return;
            const std::size_t before = script_.commands.size();
            statement(line);
            if (!comment_.empty() && script_.commands.size() > before)
                script_.captions.push_back({script_.commands[before].frame, std::exchange(comment_, {})});
        } catch (const Refusal& refusal) {
            ++refused_;
            place_.column = refusal.column;
            if (wrong_.size() < most_messages) wrong_.push_back(io::located(place_, refusal.message));
        }
    }

    /// Whether a last line without its line feed may be half of what a killed program was writing. Lines that
    /// cannot be are those with which a recording ends, which an editor may have left without one.
    bool is_cut(std::string_view text) const {
        const bool is_signature =
            text.starts_with(signature_start) && text.size() == signature_start.size() + signature_digits;
        return script_.origin && !signed_ && !text.ends_with(" end") && !is_signature;
    }

    CommandScript result() {
        if (refused_ > wrong_.size())
            wrong_.push_back(fmt::format("... and {} more", refused_ - wrong_.size()));
        if (!wrong_.empty()) throw io::InputError(io::joined(wrong_, "\n"));
        std::ranges::stable_sort(script_.commands, {}, &TimedCommand::frame);
        std::ranges::stable_sort(script_.comments, {}, &Comment::frame);
        return std::move(script_);
    }

private:
    /// Takes a recording's signature, which app/signature.h checks: here it is enough that it is one.
    bool signature(std::string_view text) {
        if (!text.starts_with("signature ")) return false;
        const auto is_digit = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); };
        const bool fits = text.starts_with(signature_start) &&
                          text.size() == signature_start.size() + signature_digits &&
                          std::ranges::all_of(text.substr(signature_start.size()), is_digit);
        if (!fits || !script_.origin)
            throw Refusal{1,
                          fmt::format("expected, at the end of a recording, '{}' and {} hexadecimal digits",
                                      signature_start, signature_digits)};
        signed_ = true;
        return true;
    }

    /// Takes a line of a recording's header.
    bool header(std::string_view text, int number) {
        while (!text.empty() && (text.back() == '\r' || text.back() == ' ')) text.remove_suffix(1);
        const auto takes = [&text](std::string_view start) {
            if (!text.starts_with(start)) return false;
            text.remove_prefix(start.size());
            return true;
        };
        // Recordings of the first version said this in comments.
        if (number == 1 && takes("# recorded by ")) {
            script_.origin.emplace().program = text;
            return true;
        }
        if (number <= 2 && takes("# scenario ")) {
            if (!script_.origin) script_.origin.emplace();
            script_.origin->scenario = text;
            return true;
        }
        if (takes("recording ")) {
            const auto version = io::parse_integer(text);
            if (number == 1 && version && *version > 0 && *version < recording_schema)
                throw Refusal{1,
                              fmt::format("expected 'recording {}', found 'recording {}': wires have moved "
                                          "otherwise since then; the version of the program that it names "
                                          "plays it, or this one its commands alone, as a script",
                                          recording_schema, text)};
            if (number != 1 || version != recording_schema)
                throw Refusal{1,
                              fmt::format("expected 'recording {}' in the first line, found 'recording {}'",
                                          recording_schema, text)};
            script_.origin.emplace();
            return true;
        }
        if (takes("lesson ")) {
            lesson(text);
            return true;
        }
        for (const std::string_view key :
             {"program ", "scenario ", "anatomy ", "patient ", "practice ", "learner ", "date "}) {
            if (!takes(key)) continue;
            if (!script_.origin || last_frame_ > 0 || !script_.commands.empty())
                throw Refusal{
                    1,
                    fmt::format(
                        "'{}' was found; expected it only at the start of a recording, after 'recording {}'",
                        key.substr(0, key.size() - 1), recording_schema)};
            origin(key, text);
            return true;
        }
        return false;
    }

    /// "31 of 34" steps.
    void lesson(std::string_view text) {
        const std::size_t of = text.find(" of ");
        const auto number = [](std::string_view word) { return io::parse_integer(word).value_or(-1); };
        const auto steps = of == std::string_view::npos ? -1 : number(text.substr(of + 4)),
                   steps_done = of == std::string_view::npos ? -1 : number(text.substr(0, of));
        if (!script_.origin || steps < 1 || steps > 10000 || steps_done < 0 || steps_done > steps)
            throw Refusal{
                1, fmt::format("expected, in a recording, 'lesson DONE of STEPS', found 'lesson {}'", text)};
        script_.origin->steps_done = static_cast<int>(steps_done);
        script_.origin->steps = static_cast<int>(steps);
    }

    void origin(std::string_view key, std::string_view text) {
        Origin& origin = *script_.origin;
        const int column = static_cast<int>(key.size()) + 1;
        if (key == "learner ") {
            if (!is_learner_in_file(text))
                throw Refusal{column,
                              fmt::format("expected a name of at most {} bytes without control characters",
                                          longest_learner)};
            origin.learner = text;
            return;
        }
        if (key == "patient ") {
            const auto plain = [](char c) {
                return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || c == ':';
            };
            if (text.empty() || text.size() > 32 || !std::ranges::all_of(text, plain))
                throw Refusal{column, fmt::format("expected a number, or seed:17, found '{}'", text)};
            origin.patient = text;
            return;
        }
        if (key == "practice ") {
            if (text != "free") throw Refusal{column, fmt::format("expected 'free', found '{}'", text)};
            origin.free_practice = true;
            return;
        }
        if (key == "date ") {
            origin.date = parse_date(text);
            if (!origin.date)
                throw Refusal{column, "expected a time such as 2026-11-26T20:31:05Z, from the year 1970 on"};
            return;
        }
        const auto hash = io::parse_hash(text.substr(0, 16));
        if (!hash) throw Refusal{column, "expected a hash of 16 hexadecimal digits"};
        const std::string_view name = text.size() > 17 ? text.substr(17) : std::string_view();
        if (key == "program ") {
            origin.program = name;
            origin.program_hash = *hash;
        } else if (key == "scenario ") {
            origin.scenario = name;
            origin.scenario_hash = *hash;
        } else {
            origin.anatomy_hash = *hash;
        }
    }

    void statement(Line& line) {
        const Word& first = line.take("");
        place_.column = first.column;
        if (first.text == "state") return state(line);

        const auto dots = first.text.find("..");
        const int from = frame_number(first, first.text.substr(0, dots));
        const int to =
            dots == std::string_view::npos ? from : frame_number(first, first.text.substr(dots + 2));
        if (to < from) Line::refuse(first, "expected a range that ends at or after its first frame");
        if (from < last_start_) {
            Line::refuse(first, fmt::format("frames must be in order; expected {} or later", last_start_));
        }
        refuse_after_end(first, to);
        last_start_ = from;
        const Word& verb = line.take("expected " + io::joined(known_verbs()));
        place_.column = verb.column;
        if (verb.text == "end") {
            line.finish();
            if (to < last_frame_) {
                Line::refuse(first, fmt::format("the run ends before frame {}, which has a command, a state "
                                                "or a comment; expected {} or later",
                                                last_frame_, last_frame_));
            }
            script_.end = to;
            return;
        }
        const Command read = command(verb, line);
        line.finish();
        last_frame_ = std::max(last_frame_, to);
        if (script_.commands.size() + static_cast<std::size_t>(to - from) >= most_commands) {
            Line::refuse(first, fmt::format("expected {} commands in all", most_commands));
        }
        for (int frame = from; frame <= to; ++frame) script_.commands.push_back({frame, read, place_});
    }

    void refuse_after_end(const Word& word, int frame) const {
        if (script_.end && frame > *script_.end)
            Line::refuse(word,
                         fmt::format("the run ends at frame {}; expected nothing after it", *script_.end));
    }

    void state(Line& line) {
        const Word& frame_word = line.take("expected the frame of the state");
        const int frame = frame_number(frame_word, frame_word.text);
        const Word& hash_word = line.take("expected a hash of 16 hexadecimal digits");
        const std::optional<std::uint64_t> hash = io::parse_hash(hash_word.text);
        if (!hash) Line::refuse(hash_word, "expected a hash of 16 hexadecimal digits");
        line.finish();
        if (!script_.checks.empty() && frame < script_.checks.back().frame) {
            Line::refuse(frame_word, fmt::format("frames must be in order; expected {} or later",
                                                 script_.checks.back().frame));
        }
        refuse_after_end(frame_word, frame);
        last_frame_ = std::max(last_frame_, frame);
        script_.checks.push_back({frame, *hash, place_});
    }

    /// A teacher's comment: the frame, and all else of the line. Its frame may lie before those of the lines
    /// around it.
    void remark(std::string_view text) {
        constexpr std::size_t start = std::string_view("comment ").size();
        while (text.ends_with('\r') || text.ends_with(' ')) text.remove_suffix(1);
        const std::size_t end = std::min(text.find(' ', start), text.size());
        const Word word{text.substr(std::min(start, end), end - std::min(start, end)),
                        static_cast<int>(start) + 1};
        const int frame = frame_number(word, word.text);
        refuse_after_end(word, frame);
        const std::string_view said = text.substr(std::min(end + 1, text.size()));
        if (!is_comment(said))
            throw Refusal{static_cast<int>(end) + 2,
                          fmt::format("expected a text of 1 to {} bytes of UTF-8 without control characters",
                                      longest_comment)};
        if (script_.comments.size() >= most_comments)
            Line::refuse(word, fmt::format("expected {} comments in all", most_comments));
        last_frame_ = std::max(last_frame_, frame);
        script_.comments.push_back({frame, std::string(said)});
    }

    void comment(std::string_view text) {
        const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '#'; };
        while (!text.empty() && blank(text.front())) text.remove_prefix(1);
        while (!text.empty() && blank(text.back())) text.remove_suffix(1);
        if (comment_.size() + text.size() > longest_caption) return;
        if (!comment_.empty() && !text.empty()) comment_ += ' ';
        comment_ += text;
    }

    static constexpr std::size_t longest_caption = 2000;  // bytes; what is longer is no caption
    CommandScript script_;
    io::TextPlace place_;
    std::string comment_;  // above the line that is read
    int last_start_ = 0;   // first frame of the line before
    int last_frame_ = 0;   // of any command, state or comment so far
    bool signed_ = false;  // by the line before
    std::size_t refused_ = 0;
    std::vector<std::string> wrong_;
};

}  // namespace

bool is_learner(std::string_view name) {
    return is_learner_in_file(name) && io::is_utf8(name);
}

bool is_learner_in_file(std::string_view name) {
    return !name.empty() && name.size() <= longest_learner && std::ranges::none_of(name, [](char c) {
        const auto code = static_cast<unsigned char>(c);
        return code < 0x20 || code == 0x7f;
    });
}

CommandScript parse_commands(std::string_view text, const std::string& file) {
    Parser parser(file);
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // a byte order mark, as some editors write
    for (int number = 1; !text.empty(); ++number) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        if (end == text.size() && parser.is_cut(text)) break;
        parser.read(text.substr(0, end), number);
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return parser.result();
}

std::string_view CommandScript::caption_at(int frame) const {
    std::string_view text;
    for (const Caption& caption : captions)
        if (caption.frame <= frame) text = caption.text;
    return text;
}

CommandScript load_commands(const std::filesystem::path& path) {
    return parse_commands(io::read_text(path, "command file", "expected lines of 'frame verb arguments'"),
                          path.string());
}

}  // namespace script
