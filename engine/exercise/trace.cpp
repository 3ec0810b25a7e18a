#include "engine/exercise/trace.h"

#include "engine/io/csv.h"

namespace exercise {
namespace {

/// The cells of a field's value.
struct Cells {
    const Reading& reading;
    const anatomy::Anatomy& anatomy;
    std::vector<io::CsvCell>& cells;

    void operator()(std::int64_t value) const { cells.emplace_back(static_cast<double>(value)); }
    void operator()(double value) const { cells.emplace_back(value); }
    void operator()(bool value) const { cells.emplace_back(value ? 1.0 : 0.0); }
    void operator()(const Place& place) const { cells.insert(cells.end(), place.begin(), place.end()); }
    void operator()(const InImage& place) const {
        cells.emplace_back(place.x);
        cells.emplace_back(place.y);
    }
    void operator()(const OfDevices& value) const { cells.emplace_back(value.of(reading.device)); }
    void operator()(Branch branch) const { cells.emplace_back(name_of(branch, anatomy)); }
    void operator()(script::Held held) const {
        cells.emplace_back(std::string(script::held_names[static_cast<std::size_t>(held)]));
    }
};

}  // namespace

std::string Trace::header() {
    std::vector<io::CsvCell> names;
    for (const Field& field : fields()) {
        if (field.column.empty()) continue;
        const std::size_t axis = field.column.find('?');
        for (const char name : std::string_view(axis == std::string_view::npos ? "?" : "xyz")) {
            std::string column(field.column);
            if (axis != std::string_view::npos) column[axis] = name;
            names.emplace_back(std::move(column));
        }
    }
    std::string text;
    io::append_row(text, names);
    return text;
}

std::string Trace::rows(const Frame& frame, const Score& score) const {
    std::string text = row(script::Held::Wire, frame, score);
    if (frame.simulation.has_catheter()) text += row(script::Held::Catheter, frame, score);
    return text;
}

std::string Trace::row(script::Held held, const Frame& frame, const Score& score) const {
    Reading reading = reader_.read(frame.simulation, frame.time, held);
    reading.air_kerma = score.air_kerma.value_or(absent);
    if (reading.inserted.of(held) <= 0) {
        reading.tip = reading.direction = {absent, absent, absent};
        reading.along = reading.path_to_target = absent;
        reading.branch = Branch::None;
    }
    std::vector<io::CsvCell> cells;
    const Cells add{reading, frame.simulation.anatomy(), cells};
    for (const Field& field : fields())
        if (!field.column.empty()) std::visit([&](const auto member) { add(reading.*member); }, field.member);
    std::string text;
    io::append_row(text, cells);
    return text;
}

}  // namespace exercise
