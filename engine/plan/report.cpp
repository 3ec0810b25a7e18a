#include "engine/plan/report.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fmt/format.h>

#include "engine/debrief/chart.h"
#include "engine/debrief/page.h"
#include "engine/debrief/page_text.h"
#include "engine/io/text.h"

namespace plan {
namespace {

using io::html_escaped;

std::string percent(double part) {
    return fmt::format("{:.0f}&nbsp;%", 100 * part);
}

/// Those that reach, of which the picture and the chart have ways.
std::vector<const Planned*> drawn(const std::vector<Planned>& all) {
    std::vector<const Planned*> some;
    for (const Planned& one : all)
        if (one.reached && some.size() < std::size(debrief::ink::devices)) some.push_back(&one);
    return some;
}

std::string verdict(const std::vector<Planned>& all) {
    const auto reached = std::ranges::count_if(all, &Planned::reached);
    std::string text = "<p class=\"verdict\">";
    if (reached == 0) {
        const Planned* nearest = nullptr;
        for (const Planned& one : all)
            if (one.refused.empty() && (!nearest || std::abs(one.left) < std::abs(nearest->left)))
                nearest = &one;
        text += "<span class=\"missed\">No course was found that reaches the target.</span>";
        if (nearest)
            text += fmt::format("<span>The nearest, with {}, ends {:.0f} mm before it.</span>",
                                html_escaped(nearest->name), std::abs(nearest->left));
    } else {
        const Planned& best = all.front();
        text += fmt::format(
            "<span class=\"reached\">{} of {} sets of devices reach the target.</span><span>Best: {}, {} of "
            "inexact hands reach, {:.2f}&nbsp;N at most on the wall, {} turn{}, {:.0f}&nbsp;s.</span>",
            reached, all.size(), html_escaped(best.name), percent(best.success()), best.peak_force,
            best.turns, best.turns == 1 ? "" : "s", best.seconds);
    }
    text += "</p>";
    if (std::ranges::any_of(all, &Planned::stopped))
        text +=
            "<p class=\"note\">Time was up before the search had ended: what follows is the best so far.</p>";
    return text;
}

std::string table(const std::vector<Planned>& all) {
    std::string text =
        "<table><thead><tr><th>Devices</th><th>reach</th><th>off by 5 %</th><th>at the keys</th><th>force, "
        "most</th><th>mean</th><th>turns</th><th>travel</th><th>time</th><th>dose</th><th>contrast</th></tr>"
        "</thead><tbody>";
    for (const Planned& one : all) {
        text += fmt::format("<tr><td>{}<br><small class=\"about\">{}</small></td>", html_escaped(one.name),
                            html_escaped(io::joined(one.devices)));
        if (!one.refused.empty()) {
            text += fmt::format("<td colspan=\"10\" style=\"text-align:left\">not possible: {}</td></tr>",
                                html_escaped(one.refused));
            continue;
        }
        if (!one.reached) {
            text += fmt::format(
                "<td class=\"missed\">no</td><td colspan=\"9\" style=\"text-align:left\">ends "
                "{:.0f}&nbsp;mm before the target{}</td></tr>",
                std::abs(one.left), one.stopped ? " (time was up)" : "");
            continue;
        }
        text += fmt::format(
            "<td class=\"reached\">yes{}</td><td>{} of {}</td><td>{} of {}</td><td>{:.2f}&nbsp;N</td>"
            "<td>{:.2f}&nbsp;N</td><td>{}</td><td>{:.0f}&nbsp;mm</td><td>{:.0f}&nbsp;s</td><td>{}</td>"
            "<td>{:.0f}&nbsp;ml</td></tr>",
            one.within_limits ? "" : ", beyond a limit", one.hands_reach, one.hands, one.played_reach,
            one.played, one.peak_force, one.mean_force, one.turns, one.travel, one.seconds,
            one.air_kerma ? fmt::format("{:.2f}&nbsp;mGy", *one.air_kerma) : "&ndash;", one.contrast);
    }
    return text + "</tbody></table>";
}

std::string failures(const std::vector<Planned>& all) {
    std::string text;
    for (const Planned& one : all) {
        if (one.reached || !one.refused.empty() || one.failures.empty()) continue;
        text += fmt::format("<h3>{}</h3><ul>", html_escaped(one.name));
        for (std::size_t k = 0; k < std::min<std::size_t>(5, one.failures.size()); ++k) {
            const Failure& why = one.failures[k];
            text += fmt::format(
                "<li>The {} {} in {}, {:.0f}&nbsp;mm along it, {:.0f}&nbsp;mm from the target ({} "
                "time{}).</li>",
                script::name_of(why.device), ending_names[static_cast<std::size_t>(why.ending)],
                html_escaped(why.branch), why.along, why.left, why.times, why.times == 1 ? "" : "s");
        }
        text += "</ul>";
    }
    return text.empty() ? "" : "<h2>Where the others fail</h2>" + text;
}

std::string views_of(const ReportCase& of) {
    if (of.views.empty()) return "";
    std::string text =
        "<h2>Views, step by step</h2><p class=\"about\">The best of all angles that stand, table and patient "
        "leave free: little foreshortening, little covered by other vessels, ostia in profile.</p>"
        "<div class=\"frames\">";
    for (std::size_t k = 0; k < of.views.size(); ++k) {
        const StepViews& step = of.views[k];
        text += "<figure>";
        if (k < of.pictures.size() && !of.pictures[k].empty())
            text += fmt::format("<img alt=\"angiogram of step {}\" src=\"data:image/png;base64,{}\">", k + 1,
                                debrief::base64(of.pictures[k]));
        text += fmt::format("<figcaption>{}. {}<br>", k + 1, html_escaped(step.target.name));
        for (const BestView& view : step.best)
            text += fmt::format("<b>{}</b>: {:.0f}&nbsp;% foreshortened, {:.0f}&nbsp;% covered<br>",
                                html_escaped(text_of(view.angles)), 100 * view.figures.foreshortening,
                                100 * view.figures.overlap);
        if (step.best.empty()) text += "no angle that stand and patient leave free";
        text += "</figcaption></figure>";
    }
    return text + "</div>";
}

std::string how_sure(const Planned& best) {
    const exercise::ModelErrors& errors = best.model_errors;
    std::string text =
        "<h2>How sure</h2><p class=\"about\">How far the tip is, at the end of the best course, from where "
        "it "
        "would be without each of these, to first order by the tip's response.</p>"
        "<table><thead><tr><th>What is left out or coarse</th><th>tip</th></tr></thead><tbody>";
    const auto row = [&text](const std::string& what, const std::optional<double>& tip) {
        text += fmt::format("<tr><td>{}</td><td>{}</td></tr>", what,
                            tip ? "&plusmn;" + io::rounded_text(*tip) + "&nbsp;mm" : "&ndash;");
    };
    row(best.force_error
            ? fmt::format("segments of a finite length (largest force on the wall &plusmn;{}&nbsp;N)",
                          io::rounded_text(*best.force_error))
            : "segments of a finite length",
        best.tip_error);
    row(errors.wall_off
            ? fmt::format("the wall's field in place of the lumen's mesh, to its order alone (at most "
                          "{}&nbsp;mm off where a joint touches)",
                          io::rounded_text(*errors.wall_off))
            : "the wall's field in place of the lumen's mesh",
        errors.wall);
    row("vessels that stay, though they would make way", errors.vessels);
    row("rigid shafts, though their torque would wind them up", errors.twist);
    text += "</tbody></table><p class=\"about\">A dash: there is no such error, or no estimate of it.</p>";
    if (best.left_out.empty()) return text;
    text += "<ul class=\"advice\">";
    for (std::string one : best.left_out) {
        one.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(one.front())));
        text += fmt::format("<li>{}.</li>", html_escaped(one));
    }
    return text + "</ul>";
}

std::string sensitivity_table(const Planned& one) {
    if (one.sensitivities.empty()) return "";
    std::string text =
        "<h2>What the best course depends on</h2><p class=\"about\">The whole course played again with one "
        "quantity changed to either side. What moves the tip or costs the target is what has to be known. "
        "\"At the end alone\": what tip and largest force would do at the end with all hubs held, to first "
        "order, by the solver's recursion; friction and amounts of the hand have no such derivative, because "
        "the way makes them.</p>"
        "<table><thead><tr><th>Quantity</th><th>change</th><th>tip moves</th><th>at the end "
        "alone</th><th>largest force changes</th><th>at the end alone</th>"
        "<th>reach</th></tr></thead><tbody>";
    std::vector<Sensitivity> sorted = one.sensitivities;
    std::ranges::stable_sort(sorted, [](const Sensitivity& a, const Sensitivity& b) {
        return std::pair(a.reach, -a.tip) < std::pair(b.reach, -b.tip);
    });
    for (const Sensitivity& of : sorted)
        text += fmt::format(
            "<tr><td>{}</td><td>&plusmn;{:g}&nbsp;{}</td><td>{:.2f}&nbsp;mm</td><td>{}</td>"
            "<td>{:.3f}&nbsp;N</td><td>{}</td><td{}>{} of 2</td></tr>",
            html_escaped(of.of), of.change, html_escaped(of.unit), of.tip,
            of.at_end ? fmt::format("{:.2f}&nbsp;mm", *of.at_end) : "&ndash;", of.force,
            of.force_at_end ? fmt::format("{:.3f}&nbsp;N", *of.force_at_end) : "&ndash;",
            of.reach < 2 ? " class=\"worse\"" : "", of.reach);
    return text + "</tbody></table>";
}

}  // namespace

std::string report(const ReportCase& of, const std::vector<Planned>& ranked) {
    const std::vector<const Planned*> some = drawn(ranked);
    debrief::VesselPicture picture{of.vessels.branches, of.target, of.target_radius, {}};
    std::vector<debrief::Line> forces;
    std::string legend;
    for (std::size_t k = 0; k < some.size(); ++k) {
        const char* colour = debrief::ink::devices[k];
        geometry::Polyline way;
        debrief::Line force{some[k]->name, colour, {}};
        for (const Moment& m : some[k]->moments) {
            way.push_back(m.tip);
            force.points.emplace_back(m.seconds, m.force);
        }
        picture.ways.emplace_back(std::move(way), colour);
        forces.push_back(std::move(force));
        legend += fmt::format("<i style=\"background:{}\"></i>{}", colour, html_escaped(some[k]->name));
    }
    if (picture.ways.empty()) picture.ways.push_back({{of.entry, of.target}, "none"});
    std::string risks;
    for (const Risk& risk : of.risks) risks += fmt::format("<li>{}</li>", html_escaped(risk.said));
    std::string not_tried;
    for (const std::string& one : of.not_tried) not_tried += fmt::format("<li>{}</li>", html_escaped(one));
    std::string body = fmt::format("<h1>Plan: {}</h1><p class=\"about\">{}</p>{}", html_escaped(of.title),
                                   html_escaped(of.program), verdict(ranked));
    body += "<h2>The way</h2>" + debrief::ways_over_vessels(picture) +
            fmt::format("<p class=\"legend\">Way of the tip:{}. The circle is the target.</p>", legend);
    body +=
        "<h2>Devices, the best first</h2>" + table(ranked) +
        "<p class=\"about\">Ranked by how many of the inexact hands reach, then by the largest force on the "
        "wall in steps of 0.05&nbsp;N, its mean in steps of 0.02&nbsp;N, turns and time. Ten hands are off "
        "by "
        "up to 5&nbsp;% of every amount, five play at the keys of the room. Dose and contrast are those of "
        "fluoroscopy in the best view of each step, the beam on from the first frame, with an angiogram of "
        "each step before it is gone. There is none, and 0&nbsp;ml, where the patient's limit leaves no "
        "contrast, or where hands that wait for it no longer reach in time.</p>";
    if (!ranked.empty() && ranked.front().reached) body += how_sure(ranked.front());
    if (!forces.empty())
        body += "<h2>Force on the wall</h2>" +
                debrief::line_chart("time, s", "largest force of one joint on the wall, N", forces);
    if (!ranked.empty() && ranked.front().reached)
        body += fmt::format(
            "<h2>The best course</h2><pre>{}</pre><p class=\"about\">It is in best.gw, with its exercise in "
            "best.toml: <code>seldinger play best.toml</code> shows it (Show me), <code>seldinger run "
            "best.toml "
            "--commands best.gw --out run</code> plays it without a window.</p>",
            html_escaped(ranked.front().course).empty() ? "" : [&] {
                // Line ends stay.
                std::string text;
                for (const std::string_view line : io::split(ranked.front().course, '\n'))
                    text += html_escaped(line) + "\n";
                return text;
            }());
    body += views_of(of);
    body += failures(ranked);
    body += "<h2>What makes the way hard</h2>" +
            (risks.empty() ? "<p>No sharp bend, thin place or steep take-off lies on the way.</p>"
                           : "<ul class=\"advice\">" + risks + "</ul>");
    if (!ranked.empty()) body += sensitivity_table(ranked.front());
    body += "<h2>What was not tried</h2><ul class=\"advice\">" + not_tried + "</ul>";
    return fmt::format(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Plan: {}</title>"
        "<style>{}</style></head><body>{}</body></html>\n",
        html_escaped(of.title), debrief::page_style, body);
}

}  // namespace plan
