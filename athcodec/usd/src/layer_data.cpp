#include "layer_data.h"

#include <pxr/sdf/schema.h>
#include <pxr/sdf/types.h>

#include <algorithm>

namespace athusd
{

namespace
{

bool Bracket(const std::vector<double> &codes, double time, double *lower, double *upper)
{
    if (codes.empty()) return false;
    const auto above = std::lower_bound(codes.begin(), codes.end(), time);
    *upper = above == codes.end() ? codes.back() : *above;
    *lower = above == codes.begin() || (above != codes.end() && *above == time) ? *upper : *(above - 1);
    return true;
}

VtValue Box(const VtVec3fArray &points, float margin)
{
    GfVec3f low = points.cfront(), high = low;
    for (const GfVec3f &point : points.AsConst())
        for (int axis = 0; axis < 3; axis++) {
            low[axis] = std::min(low[axis], point[axis]);
            high[axis] = std::max(high[axis], point[axis]);
        }
    const GfVec3f around(margin);
    return VtValue(VtVec3fArray{low - around, high + around});
}

} // namespace

LayerDataRefPtr LayerData::New(std::shared_ptr<const Motion> motion, const Scene &scene, int level,
                               const SdfAbstractDataConstPtr &specs)
{
    const LayerDataRefPtr data = TfCreateRefPtr(new LayerData);
    data->_motion = std::move(motion);
    data->_level = level;
    data->_codes = scene.codes;
    for (const Series &series : scene.series) data->_series.emplace(series.path, series);
    data->_specs = TfCreateRefPtr(new SdfData);
    data->_specs->CopyFrom(specs);
    return data;
}

const Series *LayerData::_Find(const SdfPath &path) const
{
    const auto found = _series.find(path);
    return found == _series.end() ? nullptr : &found->second;
}

VtValue LayerData::_Sample(const Series &series, size_t frame) const
{
    VtVec3fArray points;
    if (!_motion->Points(series.clip, int(frame), _level, series.first, series.count, &points)) return VtValue();
    return series.is_extent ? Box(points, series.margin) : VtValue(points);
}

VtValue LayerData::_AllSamples(const Series &series) const
{
    const std::vector<double> &codes = _Codes(series);
    SdfTimeSampleMap samples;
    for (size_t frame = 0; frame < codes.size(); frame++) samples[codes[frame]] = _Sample(series, frame);
    return VtValue(samples);
}

// Somebody writes to time samples: all of them are decoded, and are the layer's own from then on.
void LayerData::_MakeOwn(const SdfPath &path)
{
    if (const Series *series = _Find(path)) {
        _specs->Set(path, SdfFieldKeys->TimeSamples, _AllSamples(*series));
        _series.erase(path);
    }
}

void LayerData::EraseSpec(const SdfPath &path)
{
    _series.erase(path);
    _specs->EraseSpec(path);
}

void LayerData::MoveSpec(const SdfPath &from, const SdfPath &to)
{
    const auto found = _series.find(from);
    if (found != _series.end()) {
        Series series = found->second;
        _series.erase(found);
        series.path = to;
        _series.emplace(to, series);
    }
    _specs->MoveSpec(from, to);
}

bool LayerData::Has(const SdfPath &path, const TfToken &field, VtValue *value) const
{
    if (field == SdfFieldKeys->TimeSamples)
        if (const Series *series = _Find(path)) {
            if (value) *value = _AllSamples(*series);
            return true;
        }
    return _specs->Has(path, field, value);
}

bool LayerData::Has(const SdfPath &path, const TfToken &field, SdfAbstractDataValue *value) const
{
    if (field == SdfFieldKeys->TimeSamples)
        if (const Series *series = _Find(path)) return !value || value->StoreValue(_AllSamples(*series));
    return _specs->Has(path, field, value);
}

VtValue LayerData::Get(const SdfPath &path, const TfToken &field) const
{
    VtValue value;
    Has(path, field, &value);
    return value;
}

void LayerData::Set(const SdfPath &path, const TfToken &field, const VtValue &value)
{
    if (field == SdfFieldKeys->TimeSamples) _series.erase(path);
    _specs->Set(path, field, value);
}

void LayerData::Set(const SdfPath &path, const TfToken &field, const SdfAbstractDataConstValue &value)
{
    if (field == SdfFieldKeys->TimeSamples) _series.erase(path);
    _specs->Set(path, field, value);
}

void LayerData::Erase(const SdfPath &path, const TfToken &field)
{
    if (field == SdfFieldKeys->TimeSamples) _series.erase(path);
    _specs->Erase(path, field);
}

std::vector<TfToken> LayerData::List(const SdfPath &path) const
{
    std::vector<TfToken> fields = _specs->List(path);
    if (_Find(path)) fields.push_back(SdfFieldKeys->TimeSamples);
    return fields;
}

std::set<double> LayerData::ListAllTimeSamples() const
{
    std::set<double> all = _specs->ListAllTimeSamples();
    for (const auto &[path, series] : _series) all.insert(_Codes(series).begin(), _Codes(series).end());
    return all;
}

std::set<double> LayerData::ListTimeSamplesForPath(const SdfPath &path) const
{
    const Series *series = _Find(path);
    if (!series) return _specs->ListTimeSamplesForPath(path);
    return std::set<double>(_Codes(*series).begin(), _Codes(*series).end());
}

bool LayerData::GetBracketingTimeSamples(double time, double *lower, double *upper) const
{
    const std::set<double> all = ListAllTimeSamples();
    return Bracket(std::vector<double>(all.begin(), all.end()), time, lower, upper);
}

size_t LayerData::GetNumTimeSamplesForPath(const SdfPath &path) const
{
    const Series *series = _Find(path);
    return series ? _Codes(*series).size() : _specs->GetNumTimeSamplesForPath(path);
}

bool LayerData::GetBracketingTimeSamplesForPath(const SdfPath &path, double time, double *lower, double *upper) const
{
    const Series *series = _Find(path);
    return series ? Bracket(_Codes(*series), time, lower, upper)
                  : _specs->GetBracketingTimeSamplesForPath(path, time, lower, upper);
}

bool LayerData::GetPreviousTimeSampleForPath(const SdfPath &path, double time, double *previous) const
{
    const Series *series = _Find(path);
    if (!series) return _specs->GetPreviousTimeSampleForPath(path, time, previous);
    const std::vector<double> &codes = _Codes(*series);
    const auto found = std::lower_bound(codes.begin(), codes.end(), time);
    if (found == codes.begin()) return false;
    *previous = *(found - 1);
    return true;
}

bool LayerData::QueryTimeSample(const SdfPath &path, double time, VtValue *value) const
{
    const Series *series = _Find(path);
    if (!series) return _specs->QueryTimeSample(path, time, value);
    const std::vector<double> &codes = _Codes(*series);
    const auto found = std::lower_bound(codes.begin(), codes.end(), time);
    if (found == codes.end() || *found != time) return false;
    if (!value) return true;
    *value = _Sample(*series, size_t(found - codes.begin()));
    return !value->IsEmpty();
}

bool LayerData::QueryTimeSample(const SdfPath &path, double time, SdfAbstractDataValue *value) const
{
    if (!_Find(path)) return _specs->QueryTimeSample(path, time, value);
    VtValue sample;
    return QueryTimeSample(path, time, value ? &sample : nullptr) && (!value || value->StoreValue(sample));
}

void LayerData::SetTimeSample(const SdfPath &path, double time, const VtValue &value)
{
    _MakeOwn(path);
    _specs->SetTimeSample(path, time, value);
}

void LayerData::EraseTimeSample(const SdfPath &path, double time)
{
    _MakeOwn(path);
    _specs->EraseTimeSample(path, time);
}

void LayerData::_VisitSpecs(SdfAbstractDataSpecVisitor *visitor) const
{
    struct Forward : SdfAbstractDataSpecVisitor {
        SdfAbstractDataSpecVisitor *to;
        const LayerData *data;
        bool VisitSpec(const SdfAbstractData &, const SdfPath &path) override { return to->VisitSpec(*data, path); }
        void Done(const SdfAbstractData &) override {}
    } forward;
    forward.to = visitor;
    forward.data = this;
    _specs->VisitSpecs(&forward);
}

} // namespace athusd
