#include "engine/debrief/teacher_section.h"

#include <algorithm>
#include <fmt/format.h>
#include <vector>

#include "engine/exercise/teacher_marks.h"
#include "engine/io/text.h"

namespace debrief {
namespace {

struct Item {
    int frame = 0;
    const char* kind;  // class of CSS
    std::string text;
};

/// Of the attempt's moment; 0 for one that it does not have.
double seconds_of(const Story& story, int frame) {
    const auto moment = std::lower_bound(story.moments.begin(), story.moments.end(), frame,
                                         [](const Moment& m, int number) { return m.frame < number; });
    if (moment == story.moments.end() || moment->frame != frame) return 0;
    return moment->seconds;
}

std::vector<Item> items_of(const Story& story) {
    std::vector<Item> items;
    for (const script::Comment& comment : story.comments)
        items.push_back({comment.frame, "said", comment.text});
    for (const exercise::TeacherMark& mark : story.score.teacher)
        items.push_back({mark.frame, "did", exercise::text_of(mark.act)});
    std::stable_sort(items.begin(), items.end(),
                     [](const Item& a, const Item& b) { return a.frame < b.frame; });
    return items;
}

}  // namespace

std::string teacher_section(const Story& story) {
    const std::vector<Item> items = items_of(story);
    if (items.empty() && story.comments_before.empty()) return "";
    std::string text = "\n<h2>The teacher</h2><ul class=\"teacher\">";
    for (const script::Comment& comment : story.comments_before)
        text += fmt::format(
            "<li class=\"said\"><b>before</b>{} <small>frame {}, of an attempt before this one"
            "</small></li>",
            io::html_escaped(comment.text), comment.frame);
    for (const Item& item : items)
        text +=
            fmt::format("<li class=\"{}\" data-frame=\"{}\"><b>{}</b>{}</li>", item.kind, item.frame,
                        exercise::moment_text(seconds_of(story, item.frame)), io::html_escaped(item.text));
    return text +
           "</ul><p class=\"legend\">Nothing of this changes the figures; what was shown or hidden may "
           "have helped or hindered.</p>";
}

}  // namespace debrief
