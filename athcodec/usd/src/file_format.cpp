// The file format that USD finds by the suffix .ath.
//
//     @oak.ath@                                          all clips, as variants of the set "clip"
//     @oak.ath:SDF_FORMAT_ARGS:clip=storm&level=1@       one clip, and a level for far away
//     payload = @oak.ath@                                the same by attributes of the prim that has the payload,
//                                                        string ath:clip and int ath:level
#include "layer_data.h"
#include "motion.h"
#include "scene.h"

#include <pxr/pcp/dynamicFileFormatContext.h>
#include <pxr/pcp/dynamicFileFormatInterface.h>
#include <pxr/sdf/fileFormat.h>
#include <pxr/sdf/layer.h>
#include <pxr/tf/registryManager.h>
#include <pxr/tf/stringUtils.h>

#include <cstdlib>

SDF_NAMESPACE_OPEN_SCOPE

class AthFileFormat : public SdfFileFormat, public PcpDynamicFileFormatInterface
{
  public:
    void ComposeFieldsForFileFormatArguments(const std::string &path, const PcpDynamicFileFormatContext &context,
                                             FileFormatArguments *arguments, VtValue *data) const override;
    bool CanRead(const std::string &path) const override { return athusd::Motion::IsAth(path); }
    bool Read(SdfLayer *layer, const std::string &path, bool metadata_only) const override;

  protected:
    SDF_FILE_FORMAT_FACTORY_ACCESS;
    AthFileFormat() : SdfFileFormat(TfToken("ath"), TfToken("1.0"), TfToken("usd"), std::string("ath")) {}
    ~AthFileFormat() override = default;
};

namespace
{

// Reads what the arguments choose. Returns false where the file has no such clip or level, and says so in *why.
bool Chosen(const SdfFileFormat::FileFormatArguments &arguments, const athusd::Motion &motion, athusd::Choice *choice,
            std::string *why)
{
    const auto clip = arguments.find("clip"), level = arguments.find("level");
    if (clip != arguments.end()) {
        choice->clip = ath_clip_named(motion.File(), clip->second.c_str());
        if (choice->clip < 0) {
            std::string names;
            for (int i = 0; i < motion.Info().clip_count; i++)
                names += TfStringPrintf("%s\"%s\"", i ? ", " : "", ath_clips(motion.File())[i].name);
            *why = TfStringPrintf("clip: got \"%s\"; expected one of %s", clip->second.c_str(), names.c_str());
            return false;
        }
    }
    if (level != arguments.end()) {
        char *end;
        const long number = std::strtol(level->second.c_str(), &end, 10);
        if (level->second.empty() || *end || number < 0 || number >= motion.Info().level_count) {
            *why = TfStringPrintf("level: got \"%s\"; expected 0 to %d", level->second.c_str(),
                                  motion.Info().level_count - 1);
            return false;
        }
        choice->level = int(number);
    }
    return true;
}

} // namespace

void AthFileFormat::ComposeFieldsForFileFormatArguments(const std::string &, const PcpDynamicFileFormatContext &context,
                                                        FileFormatArguments *arguments, VtValue *) const
{
    VtValue clip, level;
    if (context.ComposeAttributeDefaultValue(TfToken("ath:clip"), &clip)) {
        if (clip.IsHolding<TfToken>())
            (*arguments)["clip"] = clip.UncheckedGet<TfToken>().GetString();
        else if (clip.IsHolding<std::string>())
            (*arguments)["clip"] = clip.UncheckedGet<std::string>();
    }
    if (context.ComposeAttributeDefaultValue(TfToken("ath:level"), &level) && level.IsHolding<int>())
        (*arguments)["level"] = TfStringPrintf("%d", level.UncheckedGet<int>());
}

bool AthFileFormat::Read(SdfLayer *layer, const std::string &path, bool metadata_only) const
{
    std::string why;
    athusd::Choice choice;
    const std::shared_ptr<athusd::Motion> motion = athusd::Motion::Open(path, &why);
    if (!motion || !Chosen(layer->GetFileFormatArguments(), *motion, &choice, &why)) {
        TF_RUNTIME_ERROR("%s: %s", path.c_str(), why.c_str());
        return false;
    }
    const athusd::Scene scene = athusd::Scene::Of(*motion, choice, metadata_only);
    SdfAbstractDataRefPtr data = athusd::LayerData::New(motion, scene, choice.level, _GetLayerData(*scene.layer));
    _SetLayerData(layer, data);
    return true;
}

TF_REGISTRY_FUNCTION(TfType) { SDF_DEFINE_FILE_FORMAT(AthFileFormat, SdfFileFormat); }

SDF_NAMESPACE_CLOSE_SCOPE
