#include "engine/script/command.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fmt/format.h>

#include "engine/io/text.h"
#include "physics/geometry/vec.h"

namespace script {
namespace {

/// The shortest number of degrees that converts back to exactly these bits.
std::string degrees_text(double angle) {
    std::array<char, 64> buffer;
    for (int digits = 1; digits <= 17; ++digits) {
        const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(),
                                                angle / geometry::degree, std::chars_format::general, digits);
        if (error != std::errc{}) break;
        const std::string_view text(buffer.data(), static_cast<std::size_t>(end - buffer.data()));
        if (const auto read = io::parse_number(text); read && *read * geometry::degree == angle)
            return io::number_text(*read);
    }
    return io::number_text(angle / geometry::degree);
}

/// "catheter ", and nothing for the wire, which is what a motion is of without a word.
std::string of(DeviceRole held) {
    return held == DeviceRole::Wire ? "" : std::string(name_of(held)) + " ";
}

struct CommandText {
    std::string operator()(const Advance& c) const {
        return "advance " + of(c.held) + io::number_text(c.length) + " mm";
    }
    std::string operator()(const Withdraw& c) const {
        return "withdraw " + of(c.held) + io::number_text(c.length) + " mm";
    }
    std::string operator()(const Rotate& c) const {
        return "rotate " + of(c.held) + degrees_text(c.angle) + " deg";
    }
    std::string operator()(const Grip& c) const {
        return fmt::format("grip {} {} mm", name_of(c.held), io::number_text(c.distance));
    }
    std::string operator()(const Pin& c) const {
        return fmt::format("pin {} {}", name_of(c.held), c.on ? "on" : "off");
    }
    std::string operator()(const TeacherAct& c) const {
        if (c.thing == TeacherAct::Thing::Paused) return "teacher paused";
        return fmt::format("teacher {} {}", teacher_things[static_cast<std::size_t>(c.thing)],
                           c.on ? "on" : "off");
    }
    std::string operator()(const Remove& c) const { return fmt::format("remove {}", name_of(c.held)); }
    std::string operator()(const Exchange& c) const {
        return fmt::format("exchange {} {}", name_of(c.held), c.device);
    }
    std::string operator()(const Inflate& c) const {
        return fmt::format("inflate {} atm", io::number_text(c.pressure));
    }
    std::string operator()(const Deflate&) const { return "deflate"; }
    std::string operator()(const Deploy&) const { return "deploy"; }
    std::string operator()(const RetrieveSheath& c) const {
        return fmt::format("retrieve sheath {} mm", io::number_text(c.length));
    }
    std::string operator()(const Beam& c) const { return c.on ? "beam on" : "beam off"; }
    std::string operator()(const Contrast& c) const {
        return "contrast " + io::number_text(c.iodine) + " mg/ml";
    }
    std::string operator()(const Inject& c) const {
        const std::string where =
            !c.branch.empty() ? "into " + c.branch
                              : fmt::format("through {}", c.introducer ? "introducer" : name_of(c.through));
        return fmt::format("inject {} ml at {} ml/s {} of {} mg/ml", io::number_text(c.volume),
                           io::number_text(c.rate), where, io::number_text(c.iodine));
    }
    std::string operator()(const SetMode& c) const { return fmt::format("mode {}", name_of(c.mode)); }
    std::string operator()(const SetPulseRate& c) const {
        return "pulse " + io::number_text(c.rate) + " per second";
    }
    std::string operator()(const NewMask&) const { return "mask"; }
    std::string operator()(const ShiftMask& c) const {
        if (c.mode == ShiftMask::Mode::Auto) return "shift auto";
        if (c.mode == ShiftMask::Mode::To && c.x == 0 && c.y == 0) return "shift off";
        return fmt::format("shift {}{} {} px", c.mode == ShiftMask::Mode::By ? "by " : "",
                           io::number_text(c.x), io::number_text(c.y));
    }
    std::string operator()(const Breathe& c) const { return c.hold ? "breath hold" : "breath free"; }
    std::string operator()(const Collimate& c) const {
        if (c.width >= widest_opening && c.height >= widest_opening) return "collimate open";
        return fmt::format("collimate {} {} mm", io::number_text(c.width), io::number_text(c.height));
    }
    std::string operator()(const SetFilter& c) const {
        const std::string_view name = filter_names[static_cast<std::size_t>(c.kind)];
        if (!c.place.is_in()) return fmt::format("filter {} out", name);
        return fmt::format("filter {} {} mm {} deg", name, io::number_text(c.place.edge),
                           io::number_text(c.place.angle / geometry::degree));
    }
    std::string operator()(const MoveTable& c) const {
        return fmt::format("table {} {} {} mm", io::number_text(c.place.x()), io::number_text(c.place.y()),
                           io::number_text(c.place.z()));
    }
    std::string operator()(const StoreReference&) const { return "reference"; }
    std::string operator()(const Reset&) const { return "reset"; }
    std::string operator()(const Complicate& c) const {
        if (c.kind == ComplicationKind::Breath)
            return fmt::format("complication breath {}", breath_manners[static_cast<std::size_t>(c.breath)]);
        std::string text =
            fmt::format("complication {} {} {} at {} mm over {} mm", name_of(c.kind), preposition(c.kind),
                        c.branch, io::number_text(c.at), io::number_text(c.over));
        if (c.kind != ComplicationKind::Thrombus) text += " by " + io::number_text(c.percent) + " percent";
        return text;
    }
    std::string operator()(const Relieve& c) const {
        if (!c.kind) return "relieve all";
        return fmt::format("relieve {} {} {}", name_of(*c.kind), preposition(*c.kind), c.branch);
    }
    std::string operator()(const MoveArm& c) const {
        std::string text = "arm";
        if (c.lao) text += " lao " + degrees_text(*c.lao) + " deg";
        if (c.cranial) text += " cranial " + degrees_text(*c.cranial) + " deg";
        if (c.sid) text += " sid " + io::number_text(*c.sid) + " mm";
        if (c.sod) text += " sod " + io::number_text(*c.sod) + " mm";
        if (c.detector_width) text += " width " + io::number_text(*c.detector_width) + " mm";
        if (c.isocentre) {
            text += fmt::format(" isocentre {} {} {} mm", io::number_text(c.isocentre->x()),
                                io::number_text(c.isocentre->y()), io::number_text(c.isocentre->z()));
        }
        return text;
    }
};

/// The digits as a number; empty for anything else.
std::optional<int> digits(std::string_view text) {
    if (!std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; })) return {};
    return io::parse_integer(text);
}

}  // namespace

std::string date_text(std::chrono::sys_seconds at) {
    const auto day = std::chrono::floor<std::chrono::days>(at);
    const std::chrono::year_month_day date(day);
    const std::chrono::hh_mm_ss time(at - day);
    return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}Z", static_cast<int>(date.year()),
                       static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()),
                       time.hours().count(), time.minutes().count(), time.seconds().count());
}

std::optional<std::chrono::sys_seconds> parse_date(std::string_view text) {
    constexpr std::string_view form = "0000-00-00T00:00:00Z";
    if (text.size() != form.size()) return {};
    for (std::size_t k = 0; k < form.size(); ++k)
        if (form[k] != '0' && text[k] != form[k]) return {};
    const auto year = digits(text.substr(0, 4)), month = digits(text.substr(5, 2)),
               day = digits(text.substr(8, 2)), hour = digits(text.substr(11, 2)),
               minute = digits(text.substr(14, 2)), second = digits(text.substr(17, 2));
    if (!year || !month || !day || !hour || !minute || !second) return {};
    const std::chrono::year_month_day date(std::chrono::year(*year),
                                           std::chrono::month(static_cast<unsigned>(*month)),
                                           std::chrono::day(static_cast<unsigned>(*day)));
    if (*year < 1970 || !date.ok() || *hour > 23 || *minute > 59 || *second > 59) return {};
    return std::chrono::sys_days(date) + std::chrono::hours(*hour) + std::chrono::minutes(*minute) +
           std::chrono::seconds(*second);
}

bool is_comment(std::string_view text) {
    return !text.empty() && text.size() <= longest_comment && text.front() != ' ' && text.back() != ' ' &&
           io::is_utf8(text) && std::ranges::none_of(text, [](char c) {
               const auto code = static_cast<unsigned char>(c);
               return code < 0x20 || code == 0x7f;
           });
}

std::optional<DeviceRole> role_named(std::string_view name) {
    if (name == "both") return DeviceRole::All;
    const auto found = std::ranges::find(role_names, name);
    if (found == role_names.end()) return std::nullopt;
    return static_cast<DeviceRole>(found - role_names.begin());
}

std::string_view preposition(ComplicationKind kind) {
    return kind == ComplicationKind::Thrombus ? "in" : "of";
}

bool is_of_teacher(const Command& command) {
    return std::holds_alternative<TeacherAct>(command) || std::holds_alternative<Complicate>(command) ||
           std::holds_alternative<Relieve>(command);
}

std::string to_text(const Command& command) {
    return std::visit(CommandText{}, command);
}

Command canonical(const Command& command) {
    const auto read_back = [](double angle) {
        return *io::parse_number(degrees_text(angle)) * geometry::degree;
    };
    Command result = command;
    if (Rotate* turn = std::get_if<Rotate>(&result)) turn->angle = read_back(turn->angle);
    if (MoveArm* move = std::get_if<MoveArm>(&result)) {
        if (move->lao) move->lao = read_back(*move->lao);
        if (move->cranial) move->cranial = read_back(*move->cranial);
    }
    return result;
}

render::CArm moved(render::CArm arm, const MoveArm& move) {
    arm.lao = move.lao.value_or(arm.lao);
    arm.cranial = move.cranial.value_or(arm.cranial);
    arm.sid = move.sid.value_or(arm.sid);
    arm.sod = move.sod.value_or(arm.sod);
    arm.detector_width = move.detector_width.value_or(arm.detector_width);
    arm.isocentre = move.isocentre.value_or(arm.isocentre);
    return arm;
}

bool is_pulse_rate(double rate) {
    return std::ranges::find(pulse_rates, rate) != pulse_rates.end();
}

std::string pulse_rates_text() {
    std::string text;
    for (std::size_t k = 0; k < pulse_rates.size(); ++k)
        text += (k == 0 ? "" : k + 1 == pulse_rates.size() ? " or " : ", ") + io::number_text(pulse_rates[k]);
    return text;
}

std::string too_many_pulses(double rate, double frame_rate) {
    return fmt::format("{} pulses per second were asked for; expected at most {}, the scenario's frame rate",
                       io::number_text(rate), io::number_text(frame_rate));
}

std::span<const TimedCommand> CommandScript::at(int frame) const {
    const auto first = std::ranges::lower_bound(commands, frame, {}, &TimedCommand::frame);
    const auto last = std::ranges::upper_bound(commands, frame, {}, &TimedCommand::frame);
    return std::span(commands).subspan(static_cast<std::size_t>(first - commands.begin()),
                                       static_cast<std::size_t>(last - first));
}

int CommandScript::last_frame(int tail) const {
    if (end) return *end;
    int last = -1;
    if (!commands.empty()) last = commands.back().frame + tail;
    if (!checks.empty()) last = std::max(last, checks.back().frame);
    return std::max(last, 0);
}

std::vector<std::string> problems(const CommandScript& script, const render::CArm& start, double frame_rate) {
    std::vector<std::string> found;
    render::CArm arm = start;
    for (const TimedCommand& timed : script.commands) {
        if (std::holds_alternative<Reset>(timed.command)) arm = start;
        if (const SetPulseRate* pulses = std::get_if<SetPulseRate>(&timed.command)) {
            if (pulses->rate > frame_rate)
                found.push_back(io::located(timed.place, too_many_pulses(pulses->rate, frame_rate)));
        }
        if (const ShiftMask* shift = std::get_if<ShiftMask>(&timed.command)) {
            const double most = largest_shift_fraction * start.pixels;
            if (std::max(std::abs(shift->x), std::abs(shift->y)) > most)
                found.push_back(
                    io::located(timed.place, fmt::format("'{}' was found; expected at most {} pixels, a "
                                                         "quarter of the image, in either direction",
                                                         to_text(timed.command), io::number_text(most))));
        }
        const MoveArm* move = std::get_if<MoveArm>(&timed.command);
        if (!move) continue;
        arm = moved(arm, *move);
        for (const std::string& text : render::problems(arm)) found.push_back(io::located(timed.place, text));
        if (found.size() > 20) break;
    }
    return found;
}

}  // namespace script
