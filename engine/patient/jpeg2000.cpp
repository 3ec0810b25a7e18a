#include "engine/patient/jpeg2000.h"

#include <algorithm>
#include <cstring>
#include <fmt/format.h>
#include <memory>
#include <openjpeg.h>

#include "engine/patient/ct_samples.h"

namespace patient {
namespace {

struct Code {
    std::span<const std::uint8_t> bytes;
    std::size_t at = 0;
};

constexpr auto ended = static_cast<OPJ_SIZE_T>(-1);

OPJ_SIZE_T read(void* to, OPJ_SIZE_T wanted, void* data) {
    Code& code = *static_cast<Code*>(data);
    const std::size_t some = std::min<std::size_t>(wanted, code.bytes.size() - code.at);
    if (some == 0) return ended;
    std::memcpy(to, code.bytes.data() + code.at, some);
    code.at += some;
    return some;
}

OPJ_OFF_T skip(OPJ_OFF_T bytes, void* data) {
    Code& code = *static_cast<Code*>(data);
    if (bytes < 0 || static_cast<std::size_t>(bytes) > code.bytes.size() - code.at) return -1;
    code.at += static_cast<std::size_t>(bytes);
    return bytes;
}

OPJ_BOOL seek(OPJ_OFF_T to, void* data) {
    Code& code = *static_cast<Code*>(data);
    if (to < 0 || static_cast<std::size_t>(to) > code.bytes.size()) return OPJ_FALSE;
    code.at = static_cast<std::size_t>(to);
    return OPJ_TRUE;
}

// A codec and a stream are both pointers to void*.
struct FreeCodec {
    void operator()(opj_codec_t* codec) const { opj_destroy_codec(codec); }
};
struct FreeStream {
    void operator()(opj_stream_t* stream) const { opj_stream_destroy(stream); }
};
struct FreeImage {
    void operator()(opj_image_t* image) const { opj_image_destroy(image); }
};

bool is_jp2(std::span<const std::uint8_t> code) {
    constexpr std::uint8_t box[] = {0, 0, 0, 12, 'j', 'P', ' ', ' '};
    return code.size() >= sizeof box && std::memcmp(code.data(), box, sizeof box) == 0;
}

}  // namespace

std::vector<std::uint16_t> decode_jpeg2000(std::span<const std::uint8_t> bytes, int columns, int rows,
                                           const std::filesystem::path& file) {
    const auto refuse = [&](const std::string& found) {
        refuse_ct(file, found,
                  fmt::format("expected {} × {} samples of up to 16 bits in whole JPEG 2000", columns, rows));
    };
    Code code{bytes};
    const std::unique_ptr<opj_codec_t, FreeCodec> codec(
        opj_create_decompress(is_jp2(bytes) ? OPJ_CODEC_JP2 : OPJ_CODEC_J2K));
    const std::unique_ptr<opj_stream_t, FreeStream> stream(opj_stream_default_create(OPJ_TRUE));
    if (!codec || !stream) throw std::bad_alloc();
    opj_stream_set_user_data(stream.get(), &code, nullptr);
    opj_stream_set_user_data_length(stream.get(), bytes.size());
    opj_stream_set_read_function(stream.get(), read);
    opj_stream_set_skip_function(stream.get(), skip);
    opj_stream_set_seek_function(stream.get(), seek);
    opj_dparameters_t parameters;
    opj_set_default_decoder_parameters(&parameters);
    opj_image_t* made = nullptr;
    const bool has_header =
        opj_setup_decoder(codec.get(), &parameters) && opj_read_header(stream.get(), codec.get(), &made);
    std::unique_ptr<opj_image_t, FreeImage> image(made);
    if (!has_header || !image) refuse("no header of JPEG 2000 was found");
    // Before memory is taken for what the header says.
    const auto wide = static_cast<OPJ_UINT32>(columns), high = static_cast<OPJ_UINT32>(rows);
    if (image->numcomps != 1 || image->x1 - image->x0 != wide || image->y1 - image->y0 != high ||
        image->comps[0].prec > 16)
        refuse(fmt::format("{} × {} samples of {} components were found", image->x1 - image->x0,
                           image->y1 - image->y0, image->numcomps));
    if (!opj_decode(codec.get(), stream.get(), image.get()) || !opj_end_decompress(codec.get(), stream.get()))
        refuse("damaged samples were found");
    const opj_image_comp_t& samples = image->comps[0];
    if (!samples.data || samples.w != wide || samples.h != high) refuse("samples of another size were found");
    std::vector<std::uint16_t> words(static_cast<std::size_t>(wide) * high);
    std::transform(samples.data, samples.data + words.size(), words.begin(),
                   [](OPJ_INT32 value) { return static_cast<std::uint16_t>(value); });
    return words;
}

}  // namespace patient
