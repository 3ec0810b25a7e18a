#include "engine/debrief/page.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

#include "engine/debrief/chart.h"
#include "engine/debrief/page_text.h"
#include "engine/exercise/score.h"
#include "engine/io/text.h"
#include "physics/geometry/vec.h"

namespace debrief {
namespace {

using exercise::Score;

/// A row of the table: what is compared, and which way is better.
struct Row {
    const char *name, *unit;
    int digits;
    enum Better { Lower, Higher, Neither } better;
    std::optional<double> (*value)(const Score&);
    std::optional<double> (*par)(const scenario::Par&) = nullptr;
};
struct Group {
    const char* name;
    std::vector<Row> rows;
};

using Value = std::optional<double>;

const std::vector<Group>& groups() {
    static const std::vector<Group> all = {
        {"Time and radiation",
         {{"Time to the target", "s", 1, Row::Lower, [](const Score& s) { return s.completion_time; },
           [](const scenario::Par& p) { return p.completion_time; }},
          {"Beam on", "s", 1, Row::Lower, [](const Score& s) { return Value(s.beam_on_time); },
           [](const scenario::Par& p) { return p.beam_on_time; }},
          {"Air kerma at the reference point", "mGy", 2, Row::Lower,
           [](const Score& s) { return s.air_kerma; }},
          {"Pulses", "", 0, Row::Lower, [](const Score& s) { return Value(s.pulses); }},
          {"DSA runs", "", 0, Row::Neither, [](const Score& s) { return Value(s.runs); }},
          {"Views", "", 0, Row::Neither, [](const Score& s) { return Value(s.views); }},
          {"Contrast", "ml", 1, Row::Lower, [](const Score& s) { return Value(s.contrast); },
           [](const scenario::Par& p) { return p.contrast; }}}},
        {"Hands",
         {{"Travel of the devices", "mm", 0, Row::Lower, [](const Score& s) { return Value(s.wire_travel); },
           [](const scenario::Par& p) { return p.wire_travel; }},
          {"Back and forth", "%", 0, Row::Lower,
           [](const Score& s) { return Value(100 * s.back_and_forth_ratio); }},
          {"Reversals", "", 0, Row::Lower, [](const Score& s) { return Value(s.reversals); }},
          {"Turned", "deg", 0, Row::Lower,
           [](const Score& s) { return Value(s.rotation / geometry::degree); }},
          {"Idle", "%", 0, Row::Lower, [](const Score& s) { return Value(100 * s.idle_share); }}}},
        {"Tip",
         {{"Path efficiency", "%", 0, Row::Higher,
           [](const Score& s) { return Value(100 * s.path_efficiency); }},
          {"Mean speed", "mm/s", 1, Row::Higher, [](const Score& s) { return Value(s.mean_tip_speed); }},
          {"Smoothness: spectral arc length", "", 2, Row::Higher,
           [](const Score& s) { return s.spectral_arc_length; }},
          {"Smoothness: log dimensionless jerk", "", 2, Row::Higher,
           [](const Score& s) { return s.log_dimensionless_jerk; }},
          {"Entries into wrong branches", "", 0, Row::Lower,
           [](const Score& s) { return Value(s.wrong_entries()); }}}},
        {"Wall",
         {{"Largest force of a joint", "N", 2, Row::Lower,
           [](const Score& s) { return Value(s.peak_wall_force); }},
          {"Mean of the largest force", "N", 3, Row::Lower,
           [](const Score& s) { return Value(s.mean_wall_force); }},
          {"Time above 1 N", "s", 1, Row::Lower, [](const Score& s) { return Value(s.time_over_force); }},
          {"Impulse of all forces", "N s", 1, Row::Lower,
           [](const Score& s) { return Value(s.wall_force_impulse); }},
          {"Errors of handling", "", 0, Row::Lower,
           [](const Score& s) { return Value(static_cast<double>(s.mishaps.size())); }}}}};
    return all;
}

std::string figure(const Value& value, const Row& row) {
    if (!value || !std::isfinite(*value)) return "&ndash;";
    return fmt::format("{:.{}f}{}{}", *value, row.digits, *row.unit ? "&nbsp;" : "", row.unit);
}

/// Whether the value is clearly off what it is compared with.
const char* judged(const Value& yours, const Value& other, const Row& row) {
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    const double mine = yours.value_or(none), theirs = other.value_or(none);
    if (!std::isfinite(mine) || !std::isfinite(theirs) || row.better == Row::Neither) return "";
    const double margin = 0.02 * std::abs(theirs) + 1e-9, over = mine - theirs;
    const double worse = row.better == Row::Lower ? over : -over;
    return worse > margin ? " class=\"worse\"" : worse < -margin ? " class=\"better\"" : "";
}

std::string table(const Story& story, const Story* before, const Story* expert) {
    const scenario::Par& par = story.scenario.lesson.par;
    std::string text = "<table><thead><tr><th></th><th>this attempt</th>";
    if (par.given()) text += "<th>par</th>";
    if (expert) text += "<th>expert</th>";
    if (before) text += "<th>attempt before</th>";
    text += "</tr></thead><tbody>";
    const int columns = 2 + par.given() + (expert != nullptr) + (before != nullptr);
    for (const Group& group : groups()) {
        text += fmt::format("<tr class=\"group\"><th colspan=\"{}\">{}</th></tr>", columns, group.name);
        for (const Row& row : group.rows) {
            const Value yours = row.value(story.score), its_par = row.par ? row.par(par) : Value();
            // Against par where there is one, else against the expert, else against oneself.
            Value other = its_par;
            if (!other && expert) other = row.value(expert->score);
            if (!other && !expert && before) other = row.value(before->score);
            text += fmt::format("<tr><td>{}</td><td{}>{}</td>", row.name, judged(yours, other, row),
                                figure(yours, row));
            if (par.given()) text += fmt::format("<td>{}</td>", figure(its_par, row));
            if (expert) text += fmt::format("<td>{}</td>", figure(row.value(expert->score), row));
            if (before) text += fmt::format("<td>{}</td>", figure(row.value(before->score), row));
            text += "</tr>";
        }
    }
    return text + "</tbody></table>";
}

std::string grade_table(const exercise::Grade& grade) {
    std::string text =
        "<table><thead><tr><th></th><th>yours</th><th>par</th><th>costs</th></tr></thead><tbody>";
    const auto number = [](const Value& value, const std::string& unit) {
        return value ? fmt::format("{:.{}f} {}", *value, unit.empty() ? 0 : 1, unit) : std::string("&ndash;");
    };
    for (const exercise::GradeLine& line : grade.lines)
        text += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td{}>{}</td></tr>", line.name,
                            number(line.yours, line.unit), number(line.par, line.unit),
                            line.cost > 0 ? " class=\"worse\"" : "",
                            line.cost > 0 ? fmt::format("&minus;{:.1f} of {:g}", line.cost, line.most) : "0");
    return text + fmt::format("</tbody></table><p class=\"about\">{}</p>",
                              io::html_escaped(exercise::grade_formula));
}

std::string errors(const Story& story) {
    const auto& marks = story.score.mishaps;
    if (marks.empty()) return "<p>None.</p>";
    std::string text = "<ol class=\"errors\">";
    for (std::size_t k = 0; k < marks.size(); ++k) {
        const exercise::MishapMark& mark = marks[k];
        const auto kind = static_cast<std::size_t>(mark.kind);
        text += fmt::format(
            "<li id=\"row{0}\"><a href=\"#e{0}\"><b>{0}</b>{1}: {2}, from {3:.1f}&nbsp;s (frame {4}), in "
            "{5}</a></li>",
            k + 1, exercise::mishap_texts[kind], exercise::amount_text(mark), mark.start, mark.first,
            io::html_escaped(exercise::place_text(mark)));
    }
    return text + "</ol>";
}

std::string wrong_ways(const Story& story) {
    std::string text;
    for (const exercise::WrongBranch& branch : story.score.wrong_branches)
        text += fmt::format(
            "<p class=\"note\">The tip went into {} {} time{}, and was there for {:.1f}&nbsp;s: it does "
            "not lead to the target.</p>",
            io::html_escaped(branch.name), branch.entries, branch.entries == 1 ? "" : "s", branch.seconds);
    return text;
}

std::string base64(std::span<const std::uint8_t> bytes) {
    constexpr const char* letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
        std::uint32_t word = 0;
        for (std::size_t k = 0; k < 3; ++k) word = word << 8 | (k < left ? bytes[i + k] : 0);
        for (std::size_t k = 0; k < 4; ++k) text += k <= left ? letters[word >> (18 - 6 * k) & 63] : '=';
    }
    return text;
}

std::string pictures(const Story& story) {
    std::string text = "<div class=\"frames\">";
    for (const KeyFrame& frame : story.key_frames)
        text += fmt::format(
            "<figure data-frame=\"{0}\"><img alt=\"frame {0}\" "
            "src=\"data:image/png;base64,{1}\"><figcaption>Frame {0}: {2}</figcaption></figure>",
            frame.frame, base64(frame.png), io::html_escaped(frame.caption));
    return text + "</div>";
}

/// The moments as the script reads them: frame, seconds, x, y, z, inserted, force, way to the target.
std::string data_of(const Story& story) {
    std::string text = "{\"moments\":[";
    for (std::size_t i = 0; i < story.moments.size(); ++i) {
        const Moment& m = story.moments[i];
        text +=
            fmt::format("{}[{},{:.3f},{:.2f},{:.2f},{:.2f},{:.2f},{:.3f},{:.2f}]", i ? "," : "", m.frame,
                        m.seconds, m.tip.x(), m.tip.y(), m.tip.z(), m.inserted.front(), m.force, m.to_target);
    }
    text += "],\"marks\":[";
    for (std::size_t k = 0; k < story.score.mishaps.size(); ++k)
        text += fmt::format("{}{}", k ? "," : "", story.score.mishaps[k].first);
    return text + "]}";
}

/// All attempts of all stories, the last of each at its end.
std::vector<const Score*> attempts_of(std::span<const Story> stories) {
    std::vector<const Score*> attempts;
    for (const Story& story : stories) {
        for (const Score& score : story.earlier) attempts.push_back(&score);
        attempts.push_back(&story.score);
    }
    return attempts;
}

std::string curves(std::span<const Story> stories) {
    const std::vector<const Score*> attempts = attempts_of(stories);
    const scenario::Par& par = stories.back().scenario.lesson.par;
    const auto curve = [&](const char* name, const char* unit, const auto& value, Value its_par = {}) {
        Curve made{name, unit, {}, its_par};
        for (const Score* score : attempts) {
            const Value found = value(*score);
            made.values.push_back(found ? *found : std::numeric_limits<double>::quiet_NaN());
        }
        return learning_curve(made);
    };
    std::string text = "<div class=\"curves\">";
    if (par.given())
        text += curve("Points", "", [&](const Score& s) { return Value(exercise::grade(s, par).points); });
    text += curve(
        "Time to the target", "s", [](const Score& s) { return s.completion_time; }, par.completion_time);
    text += curve(
        "Beam on", "s", [](const Score& s) { return Value(s.beam_on_time); }, par.beam_on_time);
    text += curve(
        "Travel", "mm", [](const Score& s) { return Value(s.wire_travel); }, par.wire_travel);
    text += curve("Errors of handling", "",
                  [](const Score& s) { return Value(static_cast<double>(s.mishaps.size())); });
    text += curve("Largest wall force", "N", [](const Score& s) { return Value(s.peak_wall_force); });
    return text +
           "</div><p class=\"legend\">Attempts in the order in which they were recorded; a cross is one "
           "that did not reach the target.</p>";
}

}  // namespace

std::string page(std::span<const Story> stories, const Story* expert) {
    const Story& story = stories.back();
    const Story* before = stories.size() > 1 ? &stories[stories.size() - 2] : nullptr;
    const scenario::Par& par = story.scenario.lesson.par;
    const std::string title = io::html_escaped(story.scenario.title);
    std::string text = fmt::format(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
        "<meta name=\"viewport\" content=\"width=device-width\">"
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; style-src "
        "'unsafe-inline'; script-src 'unsafe-inline'\">"
        "<title>Debriefing: {}</title><style>{}</style></head><body>\n",
        title, page_style);
    text += fmt::format(
        "<header><h1>{}</h1><p class=\"about\">Debriefing{}. Recording {}, scenario {}, {}.</p>", title,
        story.origin.learner.empty() ? "" : " of " + io::html_escaped(story.origin.learner),
        io::html_escaped(std::filesystem::path(story.file).filename().string()),
        io::html_escaped(story.scenario.name),
        story.origin.program.empty() ? "program unknown" : io::html_escaped(story.origin.program));
    text += "<div class=\"verdict\">";
    const exercise::Grade grade = exercise::grade(story.score, par);
    if (par.given())
        text += fmt::format("<div class=\"points\">{:.0f}<small> of 100 points</small></div>", grade.points);
    text += story.score.completion_time
                ? fmt::format("<div class=\"reached\">Target reached after {:.1f} s</div>",
                              *story.score.completion_time)
                : "<div class=\"missed\">Target not reached</div>";
    text += fmt::format(
        "<div>{} error{} of handling, {:.1f} s of beam, {:.0f} ml of contrast</div></div></header>",
        story.score.mishaps.size(), story.score.mishaps.size() == 1 ? "" : "s", story.score.beam_on_time,
        story.score.contrast);
    if (!story.differences.empty())
        text += fmt::format(
            "<p class=\"note\">This recording does not lead to the states it states; it was edited, or "
            "made by another program: {}</p>",
            io::html_escaped(story.differences.front()));
    for (const std::string& notice : story.notices)
        text += fmt::format("<p class=\"note\">{}</p>", io::html_escaped(notice));

    if (par.given()) text += "<h2>Grade</h2>" + grade_table(grade);
    text += "\n<h2>Time line</h2><p class=\"legend\">";
    for (std::size_t k = 0; k < story.scenario.devices.size(); ++k)
        text += fmt::format("<i style=\"background:{}\"></i>{}", ink::devices[k],
                            story.scenario.devices[k].name());
    text +=
        "<i style=\"background:#e69f00\"></i>beam<i style=\"background:#8a5a00\"></i>DSA"
        "<i style=\"background:#cc79a7\"></i>injection<i style=\"background:#b4003c\"></i>error; dashed: 1 "
        "N, and "
        "the target's radius. <span class=\"screen\">Click, or use the arrow keys, to look at a "
        "moment.</span></p>";
    text += time_line(story) + "<p id=\"moment\"></p>";
    text += "\n<div class=\"two\"><section><h2>Way of the tip</h2>" + way_over_vessels(story) + "</section>";
    text += "\n<section><h2>Errors of handling</h2>" + errors(story) + wrong_ways(story) + "</section></div>";
    if (!story.key_frames.empty()) text += "\n<h2>What the screen showed</h2>" + pictures(story);
    text += "\n<h2>Figures</h2>" + table(story, before, expert);
    if (attempts_of(stories).size() > 1) text += "\n<h2>Learning curve</h2>" + curves(stories);
    text += fmt::format(
        "\n<script type=\"application/json\" id=\"data\">{}</script><script>{}</script></body></html>\n",
        data_of(story), page_script);
    return io::as_utf8(text);
}

}  // namespace debrief
