// The data of a layer: prims as SdfData holds them, and time samples that are decoded when they are asked for.
#pragma once

#include "motion.h"
#include "scene.h"

#include <pxr/sdf/data.h>

#include <unordered_map>

namespace athusd
{

class LayerData;
TF_DECLARE_WEAK_AND_REF_PTRS(LayerData);

class LayerData : public SdfAbstractData
{
  public:
    // specs: those of `scene`'s layer.
    static LayerDataRefPtr New(std::shared_ptr<const Motion> motion, const Scene &scene, int level,
                               const SdfAbstractDataConstPtr &specs);

    bool StreamsData() const override { return true; }
    bool IsDetached() const override { return false; }

    void CreateSpec(const SdfPath &path, SdfSpecType type) override { _specs->CreateSpec(path, type); }
    bool HasSpec(const SdfPath &path) const override { return _specs->HasSpec(path); }
    void EraseSpec(const SdfPath &path) override;
    void MoveSpec(const SdfPath &from, const SdfPath &to) override;
    SdfSpecType GetSpecType(const SdfPath &path) const override { return _specs->GetSpecType(path); }

    bool Has(const SdfPath &path, const TfToken &field, SdfAbstractDataValue *value) const override;
    bool Has(const SdfPath &path, const TfToken &field, VtValue *value) const override;
    VtValue Get(const SdfPath &path, const TfToken &field) const override;
    void Set(const SdfPath &path, const TfToken &field, const VtValue &value) override;
    void Set(const SdfPath &path, const TfToken &field, const SdfAbstractDataConstValue &value) override;
    void Erase(const SdfPath &path, const TfToken &field) override;
    std::vector<TfToken> List(const SdfPath &path) const override;

    std::set<double> ListAllTimeSamples() const override;
    std::set<double> ListTimeSamplesForPath(const SdfPath &path) const override;
    bool GetBracketingTimeSamples(double time, double *lower, double *upper) const override;
    size_t GetNumTimeSamplesForPath(const SdfPath &path) const override;
    bool GetBracketingTimeSamplesForPath(const SdfPath &path, double time, double *lower, double *upper) const override;
    bool GetPreviousTimeSampleForPath(const SdfPath &path, double time, double *previous) const override;
    bool QueryTimeSample(const SdfPath &path, double time, VtValue *value) const override;
    bool QueryTimeSample(const SdfPath &path, double time, SdfAbstractDataValue *value) const override;
    void SetTimeSample(const SdfPath &path, double time, const VtValue &value) override;
    void EraseTimeSample(const SdfPath &path, double time) override;

  protected:
    LayerData() = default;
    void _VisitSpecs(SdfAbstractDataSpecVisitor *visitor) const override;

  private:
    const Series *_Find(const SdfPath &path) const;
    const std::vector<double> &_Codes(const Series &series) const { return _codes[size_t(series.clip)]; }
    VtValue _Sample(const Series &series, size_t frame) const;
    VtValue _AllSamples(const Series &series) const;
    void _MakeOwn(const SdfPath &path);

    std::shared_ptr<const Motion> _motion;
    int _level = -1;
    std::vector<std::vector<double>> _codes;
    std::unordered_map<SdfPath, Series, SdfPath::Hash> _series;
    SdfDataRefPtr _specs;
};

} // namespace athusd
