#include "engine/studies/study_files.h"

#include <array>
#include <fmt/format.h>

#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/run/picture_file.h"
#include "engine/studies/claims.h"

namespace studies {
namespace {

const char* const style =
    "body{font:16px/1.45 sans-serif;max-width:70em;margin:2em auto;padding:0 1em;color:#222}\n"
    "figure{margin:1.5em 0}img{max-width:100%;height:auto;border:1px solid #ddd}\n"
    "figcaption{color:#444}table{border-collapse:collapse;width:100%;font-size:14px}\n"
    "th,td{border:1px solid #ccc;padding:.3em .5em;text-align:left;vertical-align:top}\n"
    "td.verdict{white-space:nowrap}td.reproduced{background:#d9efe6}td.differs{background:#fbe3d6}td.other{"
    "background:#eee}dt{font-weight:bold;float:left;width:8em}h4{margin-bottom:.3em}table.counts{width:auto}";

/// What the classes of claims mean, and how many each study has of them.
std::string counts_html(std::span<const ClaimList> lists) {
    static constexpr std::array<std::pair<const char*, const char*>, 6> meanings = {
        {{"reproduced", "a statement of the paper that could have failed here, and holds"},
         {"differs", "one that does not hold; its note has the reason and what shows it"},
         {"calibrated", "a number that a tube was chosen by"},
         {"identity", "true by construction: a check of the program"},
         {"machine", "a processor time, reported and never counted"},
         {"extension", "not the paper's"}}};
    std::string html = "<dl>\n", heads;
    for (const auto& [name, meaning] : meanings) {
        html += fmt::format("<dt>{}</dt><dd>{}</dd>\n", name, meaning);
        heads += fmt::format("<th>{}</th>", name);
    }
    html += fmt::format("</dl>\n<table class=\"counts\">\n<tr><th>study</th>{}</tr>\n", heads);
    const auto row = [&](const std::string& name, std::span<const ClaimList> of) {
        html += fmt::format("<tr><td>{}</td>", name);
        for (const auto& [word, count] : claim_counts(of)) {
            // What is reproduced holds, what differs does not, and of a time it is not said.
            const bool plain = word == "reproduced" || word == "differs" || word == "machine";
            html += count.claims == 0 ? std::string("<td></td>")
                    : plain           ? fmt::format("<td>{}</td>", count.claims)
                                      : fmt::format("<td>{} of {} hold</td>", count.holding, count.claims);
        }
        html += "</tr>\n";
    };
    for (const ClaimList& list : lists)
        row(fmt::format("<a href=\"#claims-{0}\">{0}</a>", io::html_escaped(list.study)), {&list, 1});
    row("<b>all</b>", lists);
    return html + "</table>\n";
}

std::string table_html(const io::Table& table) {
    std::string html = "<table>\n<tr>";
    for (const std::string& column : table.columns) html += "<th>" + io::html_escaped(column) + "</th>";
    html += "</tr>\n";
    for (const auto& row : table.rows) {
        html += "<tr>";
        for (std::size_t k = 0; k < row.size(); ++k) {
            const std::string& word = std::get<std::string>(row[k]);
            const bool decided = word == "reproduced" || word == "differs";
            html += table.columns[k] == "verdict"
                        ? fmt::format("<td class=\"verdict {}\">{}</td>", decided ? word : "other", word)
                        : "<td>" + io::html_escaped(word) + "</td>";
        }
        html += "</tr>\n";
    }
    return html + "</table>\n";
}

/// The claims of a study, figure by figure, each with its note.
std::string claims_html(const ClaimList& list) {
    std::string html;
    for (const std::string& figure : figures_of(list.claims)) {
        if (!figure.empty()) html += fmt::format("<h4>{}</h4>\n", io::html_escaped(figure));
        for (const auto& [of, note] : list.notes)
            if (of == figure) html += fmt::format("<p>{}</p>\n", io::html_escaped(note));
        html += table_html(claims_table(list.claims, figure));
    }
    return html;
}

/// `size`: what has the width and height [pixels].
template <class Picture, class Size>
std::string figure_html(const Study& study, const Picture& picture, const char* ending, const Size& size) {
    return fmt::format(
        "<figure>\n<img src=\"{0}/{1}.{5}\" alt=\"{1}\" width=\"{2}\" height=\"{3}\">\n"
        "<figcaption>{4}</figcaption>\n</figure>\n",
        study.id, picture.name, size.width, size.height, io::html_escaped(picture.caption), ending);
}

/// The study whose first picture opens the page.
constexpr std::string_view front_study = "pareto";

}  // namespace

std::vector<std::string> write_study(const Study& study, const StudyResult& result,
                                     const std::filesystem::path& out) {
    for (const io::Table& table : result.tables)
        io::write_whole(out / (table.name + ".csv"), io::to_csv(table));
    io::write_whole(out / (std::string(study.id) + ".md"), result.page);
    for (const auto& [name, text] : result.files) io::write_whole(out / name, text);
    if (!result.claims.empty())
        io::write_whole(
            out / "claims.json",
            claims_json(std::array{ClaimList{std::string(study.id), result.claims, result.notes}}));
    for (const StudyPicture& picture : result.pictures)
        run::write_picture(out / (picture.name + ".png"), picture.image);
    std::vector<std::string> notices;
    for (const io::Plot& plot : result.plots) {
        if (const std::string notice = io::write_plot(plot, out); !notice.empty()) notices.push_back(notice);
    }
    return notices;
}

std::string studies_html(const std::vector<std::pair<const Study*, StudyResult>>& results, bool quick) {
    std::string html = fmt::format(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>Seldinger: "
        "studies</title>\n<style>\n{}\n</style>\n</head>\n<body>\n<h1>Seldinger: studies</h1>\n"
        "<p>Generated by <code>seldinger study all{}</code>; never edited by hand.</p>\n",
        style, quick ? " --quick" : "");
    for (const auto& [study, result] : results)
        if (study->id == front_study && !result.plots.empty())
            html += figure_html(*study, result.plots.front(), "svg", result.plots.front());
    html += "<ul>\n";
    for (const auto& [study, result] : results)
        html += fmt::format("<li><a href=\"#{0}\">{0}</a>: {1}</li>\n", study->id,
                            io::html_escaped(study->question));
    std::vector<ClaimList> lists;
    for (const auto& [study, result] : results)
        if (!result.claims.empty()) lists.push_back({std::string(study->id), result.claims, result.notes});
    html += "</ul>\n<h2>Claims</h2>\n" + counts_html(lists);
    for (const ClaimList& list : lists)
        html += fmt::format("<h3 id=\"claims-{0}\">{0}</h3>\n{1}", list.study, claims_html(list));
    for (const auto& [study, result] : results) {
        html += fmt::format("<h2 id=\"{0}\">{0}</h2>\n<p>{1} <a href=\"{0}/{0}.md\">Its page</a>; tables:",
                            study->id, io::html_escaped(study->question));
        for (const io::Table& table : result.tables)
            html += fmt::format(" <a href=\"{}/{}.csv\">{}</a>", study->id, table.name, table.name);
        html += "</p>\n";
        for (const io::Plot& plot : result.plots) html += figure_html(*study, plot, "svg", plot);
        for (const StudyPicture& picture : result.pictures)
            html += figure_html(*study, picture, "png", picture.image);
    }
    return html + "</body>\n</html>\n";
}

}  // namespace studies
