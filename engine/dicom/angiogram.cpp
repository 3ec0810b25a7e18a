#include "engine/dicom/angiogram.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcostrma.h>
#include <dcmtk/dcmdata/dctk.h>
#include <dcmtk/dcmdata/dcwcache.h>
#include <exception>
#include <fmt/format.h>
#include <limits>
#include <stdexcept>
#include <utility>

#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/io/wall.h"
#include "physics/geometry/hash.h"
#include "physics/geometry/vec.h"

namespace dicom {
namespace {

constexpr std::size_t most_bytes = std::size_t{256} << 20;  // of the pixels of an object
constexpr std::size_t most_frames = 3600;  // their times must fit in 64 KiB of text (PS3.5, 7.1.2)

/// A UUID under 2.25 (PS3.5, B.2), made of the hash of a content: version 8, of the program's own making.
std::string uid_of(std::uint64_t first, std::uint64_t second) {
    first = (first & ~0xF000ull) | 0x8000ull;
    second = (second & ~(3ull << 62)) | (2ull << 62);
    __extension__ using Wide = unsigned __int128;
    Wide number = (static_cast<Wide>(first) << 64) | second;
    std::string digits;
    for (; number > 0; number /= 10) digits += static_cast<char>('0' + static_cast<int>(number % 10));
    std::ranges::reverse(digits);
    return "2.25." + digits;
}

std::string uid_of(const char* what, std::initializer_list<std::uint64_t> content) {
    geometry::Hash hash, other;
    other.add(std::uint64_t{0x5e1d});
    for (geometry::Hash* each : {&hash, &other}) {
        each->add(static_cast<std::uint64_t>(std::strlen(what)));
        each->add(what, std::strlen(what));
        for (const std::uint64_t word : content) each->add(word);
    }
    return uid_of(hash.value(), other.value());
}

/// A decimal string of at most 16 bytes.
std::string decimal(double value) {
    for (int digits = 10; digits > 0; --digits)
        if (std::string text = fmt::format("{:.{}g}", value, digits); text.size() <= 16) return text;
    return "0";
}

/// A value that must not hold the separator of values or control characters; UTF-8 of at most `most` bytes.
std::string words(std::string text, std::size_t most) {
    for (char& c : text)
        if (c == '\\' || c == '^' || c == '=' || static_cast<unsigned char>(c) < 0x20) c = ' ';
    if (text.size() > most) {
        while (most > 0 && (static_cast<unsigned char>(text[most]) & 0xC0) == 0x80) --most;
        text.resize(most);
    }
    return text;
}

/// Puts values, and keeps in mind where that failed.
class Data {
public:
    explicit Data(DcmItem& item) : item_(item) {}
    void put(const DcmTagKey& tag, const std::string& value) {
        require(item_.putAndInsertOFStringArray(tag, value.c_str()), tag);
    }
    void put(const DcmTagKey& tag, double value) { put(tag, decimal(value)); }
    void put(const DcmTagKey& tag, int value) { put(tag, std::to_string(value)); }  // an integer string
    void put_rounded(const DcmTagKey& tag, double value) { put(tag, static_cast<int>(std::lround(value))); }
    void put_short(const DcmTagKey& tag, int value) {
        require(item_.putAndInsertUint16(tag, static_cast<Uint16>(value)), tag);
    }
    static void require(const OFCondition& condition, const DcmTagKey& tag) {
        if (condition.good()) return;
        throw std::runtime_error(
            fmt::format("DICOM element {}: {}", DcmTag(tag).getTagName(), condition.text()));
    }

private:
    DcmItem& item_;
};

}  // namespace

std::string patient_orientation(const render::CArm& arm) {
    const render::ArmAxes axes = render::axes(arm);
    const auto letters = [](const geometry::Vec3& direction) {
        constexpr std::array<const char*, 3> positive = {"L", "P", "H"}, negative = {"R", "A", "F"};
        std::array<int, 3> order = {0, 1, 2};
        std::ranges::stable_sort(
            order, [&](int a, int b) { return std::abs(direction[a]) > std::abs(direction[b]); });
        constexpr double least = 0.1736;  // a direction off the plane of the others by 10 degrees
        std::string text;
        for (const int k : order)
            if (text.empty() || std::abs(direction[k]) > least)
                text += direction[k] > 0 ? positive[k] : negative[k];
        return text;
    };
    return letters(axes.right) + "\\" + letters(-axes.up);
}

void read_date(const std::string& text, Identity& identity) {
    std::string digits;
    for (const char c : text)
        if (c != '-' && c != ':') digits += c;
    const std::string date = digits.substr(0, 8), time = digits.size() > 8 ? digits.substr(8) : "T000000";
    const auto number = [](const std::string& all, std::size_t from, std::size_t count) {
        const std::string part = all.substr(std::min(from, all.size()), count);
        const bool whole =
            part.size() == count && std::ranges::all_of(part, [](char c) { return c >= '0' && c <= '9'; });
        return whole ? std::stoi(part) : -1;
    };
    const std::chrono::year_month_day day{
        std::chrono::year(number(date, 0, 4)),
        std::chrono::month(static_cast<unsigned>(std::max(0, number(date, 4, 2)))),
        std::chrono::day(static_cast<unsigned>(std::max(0, number(date, 6, 2))))};
    const int hour = number(time, 1, 2), minute = number(time, 3, 2), second = number(time, 5, 2);
    if (number(date, 0, 4) < 1 || !day.ok() || time.size() != 7 || time[0] != 'T' || hour < 0 || hour > 23 ||
        minute < 0 || minute > 59 || second < 0 || second > 59)
        throw io::InputError(
            "--dicom-date: '{}' was given; expected a date, such as 2026-11-27 or 2026-11-27T14:05:00", text);
    identity.date = date;
    identity.time = time.substr(1);
}

void read_patient(const std::string& text, Identity& identity) {
    constexpr std::size_t most = 64;  // characters of a name's group, and of an ID (PS3.5, 6.2)
    const std::size_t comma = text.find(',');
    const std::string name = text.substr(0, comma),
                      id = comma == std::string::npos ? "" : text.substr(comma + 1);
    const auto fits = [&](const std::string& part, const char* separators) {
        return part.size() <= most && std::ranges::none_of(part, [&](char c) {
                   return c == '\\' || static_cast<unsigned char>(c) < 0x20 || c == 0x7F ||
                          std::strchr(separators, c);
               });
    };
    if (name.empty() || !fits(name, "=") || !fits(id, "") || std::ranges::count(name, '^') > 4)
        throw io::InputError(
            "--dicom-patient: '{}' was given; expected a name such as Doe^Jane, or Doe^Jane,ID, of up to "
            "{} bytes each and up to five parts",
            text, most);
    identity.name = name;
    identity.id = id;
}

struct Angiogram::Content {
    Series series;
    std::vector<std::uint8_t> shown;
    std::vector<std::uint16_t> signal;
    std::vector<double> times;  // [s]
    std::vector<render::Technique> techniques;
    bool contrast = false;
    std::optional<double> iodine;  // of the agent [mg/ml]

    std::size_t area() const { return static_cast<std::size_t>(series.arm.pixels) * series.arm.pixels; }
    int bits() const { return series.pixels == Pixels::Shown ? 8 : 16; }
    void require(int width, int height, Pixels pixels) const {
        if (pixels != series.pixels) throw std::invalid_argument("a frame of other pixels than the series");
        if (width != series.arm.pixels || height != series.arm.pixels)
            throw std::invalid_argument("a frame of another size than the series");
    }
    void note(const render::Technique& technique, double seconds) {
        times.push_back(seconds);
        techniques.push_back(technique);
    }
    std::uint64_t hash() const;
    void put_identity(Data&) const;
    void put_radiation(Data&) const;
    void put_geometry(Data&) const;
    void put_times(Data&) const;
    void put_pixels(Data&, DcmItem&) const;
};

Angiogram::Angiogram(Series series) : content_(std::make_unique<Content>()) {
    if (const auto wrong = render::problems(series.arm); !wrong.empty())
        throw io::InputError(io::joined(wrong, "; "));
    content_->series = std::move(series);
}

Angiogram::~Angiogram() = default;

const Series& Angiogram::series() const {
    return content_->series;
}

int Angiogram::frames() const {
    return static_cast<int>(content_->times.size());
}

bool Angiogram::is_full() const {
    const std::size_t more = content_->times.size() + 1;
    return more > most_frames || more * content_->area() * content_->bits() / 8 > most_bytes;
}

void Angiogram::inject(std::optional<double> iodine) {
    content_->contrast = true;
    if (iodine) content_->iodine = std::max(content_->iodine.value_or(0), *iodine);
}

void Angiogram::add(const render::GrayImage& image, const render::Technique& technique, double seconds) {
    content_->require(image.width, image.height, Pixels::Shown);
    content_->shown.insert(content_->shown.end(), image.pixels.begin(), image.pixels.end());
    content_->note(technique, seconds);
}

void Angiogram::add(const render::Field& signal, const render::Technique& technique, double seconds) {
    content_->require(signal.width, signal.height, Pixels::Signal);
    const auto scale = static_cast<float>(content_->series.scale);
    content_->signal.reserve(content_->signal.size() + signal.values.size());
    for (const float value : signal.values) {
        // Electronic noise may be below 0; a value that is not a number fails the first comparison.
        const float level = value > 0 ? std::min(scale * value + 0.5f, 65535.0f) : 0.0f;
        content_->signal.push_back(static_cast<std::uint16_t>(level));
    }
    content_->note(technique, seconds);
}

std::uint64_t Angiogram::Content::hash() const {
    geometry::Hash hash;
    hash.add(series.study);
    hash.add(static_cast<std::uint64_t>(series.number));
    hash.add(static_cast<std::uint64_t>(shown.size()));
    hash.add(shown.data(), shown.size());
    hash.add(static_cast<std::uint64_t>(signal.size()));
    hash.add(signal.data(), signal.size() * sizeof(std::uint16_t));
    for (const double time : times) hash.add(time);
    return hash.value();
}

void Angiogram::Content::put_identity(Data& data) const {
    const std::string patient = words(series.patient, 64);
    data.put(DCM_SpecificCharacterSet, "ISO_IR 192");
    // As of a digitally reconstructed radiograph (PS3.3, C.8.8.2.2.1): of no examination of a patient.
    data.put(DCM_ImageType, "DERIVED\\SECONDARY\\SINGLE PLANE\\SIMULATED");
    std::string derivation = "simulated, no patient was imaged";
    if (series.pixels == Pixels::Signal)
        derivation += fmt::format("; detector signal, {:.6g} for a quantum in a pixel and nGy", series.scale);
    if (!series.derivation.empty()) derivation += "; " + series.derivation;
    data.put(DCM_DerivationDescription, words(derivation, 1024));
    data.put(DCM_SOPClassUID, UID_XRayAngiographicImageStorage);
    data.put(DCM_SOPInstanceUID, uid_of("instance", {hash()}));
    data.put(DCM_StudyDate, series.identity.date);
    data.put(DCM_StudyTime, series.identity.time);
    data.put(DCM_AccessionNumber, "");
    data.put(DCM_Modality, "XA");
    data.put(DCM_Manufacturer, "Seldinger");
    data.put(DCM_BodyPartExamined, "PHANTOM");
    data.put(DCM_ReferringPhysicianName, "");
    data.put(DCM_StudyDescription, patient);
    data.put(DCM_SeriesDescription, words("SIMULATED " + series.description, 64));
    data.put(DCM_ManufacturerModelName, "Seldinger");
    const Identity& identity = series.identity;
    data.put(DCM_PatientName, identity.name.empty() ? "Simulated^" + patient : identity.name);
    data.put(DCM_PatientID, !identity.id.empty() ? identity.id : patient.empty() ? "simulated" : patient);
    data.put(DCM_PatientBirthDate, "");
    data.put(DCM_PatientSex, "");
    data.put(DCM_SoftwareVersions, words(series.program, 64));
    if (!series.subject.empty()) data.put(DCM_OperatorsName, words(series.subject, 64));
    data.put(DCM_StudyInstanceUID, uid_of("study", {series.study}));
    data.put(DCM_SeriesInstanceUID,
             uid_of("series", {series.study, static_cast<std::uint64_t>(series.number)}));
    data.put(DCM_StudyID, fmt::format("{:016x}", series.study));
    data.put(DCM_SeriesNumber, series.number);
    data.put(DCM_Laterality, "");
    data.put(DCM_InstanceNumber, 1);
    data.put(DCM_PatientOrientation, patient_orientation(series.arm));
    data.put(DCM_QualityControlImage, "YES");  // nobody's: no patient was imaged
    data.put(DCM_ImageComments, identity.is_dated()
                                    ? "Simulated by Seldinger: no patient was imaged"
                                    : "Simulated by Seldinger: no patient, and the dates are placeholders");
    if (contrast) {
        data.put(DCM_ContrastBolusAgent, "iodinated contrast medium");
        data.put(DCM_ContrastBolusIngredient, "IODINE");
        if (iodine) data.put(DCM_ContrastBolusIngredientConcentration, *iodine);
    }
}

void Angiogram::Content::put_radiation(Data& data) const {
    double kvp = 0, current = 0, width = 0, charge = 0, area_product = 0, kerma = 0;
    for (const render::Technique& t : techniques) {
        kvp += t.kvp;
        current += t.current;
        width += t.pulse_width;
        charge += t.current * t.pulse_width;  // [µAs]
        area_product += t.area_product;
        kerma += t.air_kerma;
    }
    const auto count = static_cast<double>(techniques.size());
    data.put(DCM_KVP, kvp / count);
    data.put(DCM_RadiationSetting, series.radiation == Radiation::Fluoroscopy ? "SC" : "GR");
    data.put(DCM_RadiationMode, "PULSED");
    data.put_rounded(DCM_XRayTubeCurrent, current / count);
    data.put(DCM_AveragePulseWidth, width / count);
    data.put_rounded(DCM_ExposureTime, width);                            // of all pulses [ms]
    data.put_rounded(DCM_Exposure, 1e-3 * charge);                        // [mAs]
    data.put_rounded(DCM_ExposureInuAs, charge);                          // [µAs]
    data.put(DCM_ImageAndFluoroscopyAreaDoseProduct, 10 * area_product);  // [dGy·cm²]
    data.put(DCM_CommentsOnRadiationDose,
             fmt::format("air kerma at the reference point {:.6g} mGy, area product {:.6g} Gy cm2, simulated",
                         kerma, area_product));
}

void Angiogram::Content::put_geometry(Data& data) const {
    const render::CArm& arm = series.arm;
    const double pixel = render::pixel_width(arm), at_isocentre = pixel * arm.sod / arm.sid;
    data.put(DCM_PositionerMotion, "STATIC");
    data.put(DCM_PositionerPrimaryAngle, arm.lao / geometry::degree);
    data.put(DCM_PositionerSecondaryAngle, arm.cranial / geometry::degree);
    data.put(DCM_DistanceSourceToDetector, arm.sid);
    data.put(DCM_DistanceSourceToPatient, arm.sod);
    data.put(DCM_EstimatedRadiographicMagnificationFactor, arm.sid / arm.sod);
    const auto square = [](double width) { return decimal(width) + "\\" + decimal(width); };
    data.put(DCM_ImagerPixelSpacing, square(pixel));
    data.put(DCM_PixelSpacing, square(at_isocentre));
    data.put(DCM_PixelSpacingCalibrationType, "GEOMETRY");
    data.put(DCM_PixelSpacingCalibrationDescription, "at the isocentre");
    data.put(DCM_FieldOfViewShape, "RECTANGLE");
    const int field = static_cast<int>(std::lround(arm.detector_width));
    data.put(DCM_FieldOfViewDimensions, fmt::format("{}\\{}", field, field));
    const render::PixelBox open = render::opening_of(arm);
    data.put(DCM_CollimatorShape, "RECTANGULAR");
    data.put_rounded(DCM_CollimatorLeftVerticalEdge, open.left);
    data.put_rounded(DCM_CollimatorRightVerticalEdge, open.right);
    data.put_rounded(DCM_CollimatorUpperHorizontalEdge, open.top);
    data.put_rounded(DCM_CollimatorLowerHorizontalEdge, open.bottom);
}

void Angiogram::Content::put_times(Data& data) const {
    data.put(DCM_NumberOfFrames, static_cast<int>(times.size()));
    if (series.frame_rate > 0) {
        data.put_rounded(DCM_CineRate, std::max(1.0, series.frame_rate));
        data.put_rounded(DCM_RecommendedDisplayFrameRate, std::max(1.0, series.frame_rate));
    }
    data.put_short(DCM_PreferredPlaybackSequencing, 0);
    std::string steps = "0";  // [ms], each since the frame before
    for (std::size_t i = 1; i < times.size(); ++i) steps += "\\" + decimal(1e3 * (times[i] - times[i - 1]));
    data.put(DCM_FrameTimeVector, steps);
}

void Angiogram::Content::put_pixels(Data& data, DcmItem& item) const {
    const bool is_shown = series.pixels == Pixels::Shown;
    data.put(DCM_PixelIntensityRelationship, is_shown ? "DISP" : "LIN");
    data.put_short(DCM_SamplesPerPixel, 1);
    data.put(DCM_PhotometricInterpretation, "MONOCHROME2");
    data.put_short(DCM_Rows, series.arm.pixels);
    data.put_short(DCM_Columns, series.arm.pixels);
    data.put_short(DCM_BitsAllocated, bits());
    data.put_short(DCM_BitsStored, bits());
    data.put_short(DCM_HighBit, bits() - 1);
    data.put_short(DCM_PixelRepresentation, 0);
    data.put(DCM_LossyImageCompression, "00");
    data.require(item.putAndInsertTagKey(DCM_FrameIncrementPointer, DCM_FrameTimeVector),
                 DCM_FrameIncrementPointer);
    if (is_shown) {
        data.put(DCM_WindowCenter, "128");
        data.put(DCM_WindowWidth, "256");
        data.require(item.putAndInsertUint8Array(DCM_PixelData, shown.data(), shown.size()), DCM_PixelData);
        return;
    }
    // From nothing to what all but a fiftieth of the pixels of the first frame have.
    std::vector<std::uint16_t> first(signal.begin(), signal.begin() + static_cast<std::ptrdiff_t>(area()));
    const auto place = first.begin() + static_cast<std::ptrdiff_t>(first.size() * 98 / 100);
    std::nth_element(first.begin(), place, first.end());
    const double top = std::max<double>(*place, 2);
    data.put(DCM_WindowCenter, 0.5 * top);
    data.put(DCM_WindowWidth, top);
    if (series.first_is_mask && times.size() > 1) {
        data.put(DCM_RecommendedViewingMode, "SUB");
        DcmItem* mask = nullptr;
        data.require(item.findOrCreateSequenceItem(DCM_MaskSubtractionSequence, mask),
                     DCM_MaskSubtractionSequence);
        Data of_mask(*mask);
        of_mask.put(DCM_MaskOperation, "AVG_SUB");
        const Uint16 range[] = {2, static_cast<Uint16>(times.size())}, number[] = {1};
        of_mask.require(mask->putAndInsertUint16Array(DCM_ApplicableFrameRange, range, 2),
                        DCM_ApplicableFrameRange);
        of_mask.require(mask->putAndInsertUint16Array(DCM_MaskFrameNumbers, number, 1), DCM_MaskFrameNumbers);
    }
    data.require(item.putAndInsertUint16Array(DCM_PixelData, signal.data(), signal.size()), DCM_PixelData);
}

namespace {

/// Where DCMTK writes: a file that is complete or absent. DCMTK's own does not tell when the disk is full at
/// the end.
class FileConsumer : public DcmConsumer {
public:
    explicit FileConsumer(const std::filesystem::path& path) : file_(path) {}

    OFBool good() const override { return !failure_; }
    OFCondition status() const override { return failure_ ? EC_InvalidStream : EC_Normal; }
    OFBool isFlushed() const override { return OFTrue; }
    offile_off_t avail() const override { return std::numeric_limits<Sint32>::max(); }
    offile_off_t write(const void* bytes, offile_off_t count) override {
        try {
            file_.append({static_cast<const char*>(bytes), static_cast<std::size_t>(count)});
            return count;
        } catch (...) {
            failure_ = std::current_exception();
            return 0;
        }
    }
    void flush() override {}

    void rethrow() const {
        if (failure_) std::rethrow_exception(failure_);
    }
    void put() { file_.put(); }

private:
    io::WholeFile file_;
    std::exception_ptr failure_;  // DCMTK lets no exception pass
};

class FileStream : public DcmOutputStream {
public:
    /// The base only keeps the address.
    explicit FileStream(const std::filesystem::path& path) : DcmOutputStream(&consumer_), consumer_(path) {}

    FileConsumer& consumer() { return consumer_; }

private:
    FileConsumer consumer_;
};

}  // namespace

void Angiogram::write(const std::filesystem::path& path) const {
    const io::NoChildMeanwhile here;  // DCMTK has locks
    if (frames() == 0) throw std::logic_error("an angiogram without a frame");
    DcmFileFormat file;
    Data data(*file.getDataset());
    content_->put_identity(data);
    content_->put_radiation(data);
    content_->put_geometry(data);
    content_->put_times(data);
    content_->put_pixels(data, *file.getDataset());

    FileStream stream(path);
    file.transferInit();
    DcmWriteCache cache;
    const OFCondition saved = file.write(stream, EXS_LittleEndianExplicit, EET_ExplicitLength, &cache,
                                         EGL_recalcGL, EPD_withoutPadding, 0, 0, 0, EWM_createNewMeta);
    file.transferEnd();
    stream.consumer().rethrow();
    if (saved.bad())
        throw io::InputError("{}: the angiogram cannot be written: {}", path.string(), saved.text());
    stream.consumer().put();
}

}  // namespace dicom
