import{ACESFilmicToneMapping as Us,BackSide as Os,Box3 as or,BufferAttribute as re,BufferGeometry as Ye,CircleGeometry as Fs,Color as Y,ColorManagement as Lt,Controls as Hs,DataTexture as Bs,DirectionalLight as ar,DoubleSide as sr,DynamicDrawUsage as ks,EventDispatcher as Vs,FloatType as Gs,Fog as zs,Frustum as Ws,Group as Ze,HemisphereLight as Xs,InstancedBufferAttribute as Je,InstancedBufferGeometry as js,InstancedMesh as cr,Line as lr,LineBasicMaterial as fr,LineSegments as dr,Loader as ur,LoaderUtils as pe,MOUSE as Ks,Material as $e,MathUtils as Ct,Matrix4 as Re,Mesh as hr,MeshBasicMaterial as me,MeshDepthMaterial as qs,MeshDistanceMaterial as Ys,MeshLambertMaterial as Zs,MeshStandardMaterial as Pt,NearestFilter as Dt,NoToneMapping as Js,Object3D as be,OrthographicCamera as pr,PCFShadowMap as $s,PerspectiveCamera as mr,Plane as Qs,Points as gr,Quaternion as Ut,RGBADepthPacking as ec,RGBAFormat as tc,Ray as nc,Scene as rc,ShaderChunk as vr,ShaderMaterial as ic,ShapeUtils as oc,Sphere as _r,SphereGeometry as ac,Spherical as sc,TOUCH as cc,Texture as Ot,Vector2 as Le,Vector3 as q,Vector4 as lc,WebGLRenderTarget as fc,WebGLRenderer as dc}from"./three.js";var _n=0;var it=0,ot=1,at=2,st=3,ct=4,lt=5,ft=6,dt=7;var ut="attached",Sn="detached";var De=1e3,xn=1001,Mn=1002;var Tn=1004;var yn=1005;var Ue=1006,En=1007;var ht=1008;var An=1009;var Nn=1015;var In=1023;var z=2300,J=2301,Oe=2302,pt=2303,mt=2400,gt=2401,vt=2402,wn=2500;var Rn=0,Fe=1,ve=2;var ae="srgb",H="srgb-linear";var bn=35044;var Ln=2001;function _t(a){return ArrayBuffer.isView(a)&&!(a instanceof DataView)}function Pn(a){return document.createElementNS("http://www.w3.org/1999/xhtml",a)}var Cn={},se=null;function St(...a){let e="THREE."+a.shift();se?se("log",e,...a):console.log(e,...a)}function Dn(a){let e=a[0];if(typeof e=="string"&&e.startsWith("TSL:")){let t=a[1];t&&t.isStackTrace?a[0]+=" "+t.getLocation():a[1]='Stack trace not available. Enable "THREE.Node.captureStackTrace" to capture stack traces.'}return a}function L(...a){a=Dn(a);let e="THREE."+a.shift();if(se)se("warn",e,...a);else{let t=a[0];t&&t.isStackTrace?console.warn(t.getError(e)):console.warn(e,...a)}}function R(...a){a=Dn(a);let e="THREE."+a.shift();if(se)se("error",e,...a);else{let t=a[0];t&&t.isStackTrace?console.error(t.getError(e)):console.error(e,...a)}}function xt(...a){let e=a.join(" ");e in Cn||(Cn[e]=!0,L(...a))}var Oi={[it]:it,[at]:ft,[ct]:ct,[st]:lt,[ot]:ot,[ft]:at,[dt]:dt,[lt]:st};var b=["00","01","02","03","04","05","06","07","08","09","0a","0b","0c","0d","0e","0f","10","11","12","13","14","15","16","17","18","19","1a","1b","1c","1d","1e","1f","20","21","22","23","24","25","26","27","28","29","2a","2b","2c","2d","2e","2f","30","31","32","33","34","35","36","37","38","39","3a","3b","3c","3d","3e","3f","40","41","42","43","44","45","46","47","48","49","4a","4b","4c","4d","4e","4f","50","51","52","53","54","55","56","57","58","59","5a","5b","5c","5d","5e","5f","60","61","62","63","64","65","66","67","68","69","6a","6b","6c","6d","6e","6f","70","71","72","73","74","75","76","77","78","79","7a","7b","7c","7d","7e","7f","80","81","82","83","84","85","86","87","88","89","8a","8b","8c","8d","8e","8f","90","91","92","93","94","95","96","97","98","99","9a","9b","9c","9d","9e","9f","a0","a1","a2","a3","a4","a5","a6","a7","a8","a9","aa","ab","ac","ad","ae","af","b0","b1","b2","b3","b4","b5","b6","b7","b8","b9","ba","bb","bc","bd","be","bf","c0","c1","c2","c3","c4","c5","c6","c7","c8","c9","ca","cb","cc","cd","ce","cf","d0","d1","d2","d3","d4","d5","d6","d7","d8","d9","da","db","dc","dd","de","df","e0","e1","e2","e3","e4","e5","e6","e7","e8","e9","ea","eb","ec","ed","ee","ef","f0","f1","f2","f3","f4","f5","f6","f7","f8","f9","fa","fb","fc","fd","fe","ff"];var Hi=Math.PI/180,Un=180/Math.PI;function $(){let a=Math.random()*4294967295|0,e=Math.random()*4294967295|0,t=Math.random()*4294967295|0,n=Math.random()*4294967295|0;return(b[a&255]+b[a>>8&255]+b[a>>16&255]+b[a>>24&255]+"-"+b[e&255]+b[e>>8&255]+"-"+b[e>>16&15|64]+b[e>>24&255]+"-"+b[t&63|128]+b[t>>8&255]+"-"+b[t>>16&255]+b[t>>24&255]+b[n&255]+b[n>>8&255]+b[n>>16&255]+b[n>>24&255]).toLowerCase()}function On(a,e,t){return Math.max(e,Math.min(t,a))}function He(a){switch(a.constructor){case Uint32Array:return 4294967295;case Uint16Array:return 65535;case Uint8Array:case Uint8ClampedArray:return 255;case Int32Array:return 2147483647;case Int16Array:return 32767;case Int8Array:return 127;default:return}}function Fn(a,e){if(e.constructor===Float32Array)return a;let t=He(e);if(t===void 0)throw new Error("THREE.MathUtils: Invalid component type.");return Math.max(a/t,-1)}function Hn(a,e){if(e.constructor===Float32Array)return a;let t=He(e);if(t===void 0)throw new Error("THREE.MathUtils: Invalid component type.");return Math.round(a*t)}var ce=class{constructor(e,t){this.isInterleavedBuffer=!0,this.array=e,this.stride=t,this.count=e!==void 0?e.length/t:0,this.usage=bn,this.updateRanges=[],this.version=0,this.uuid=$()}onUploadCallback(){}set needsUpdate(e){e===!0&&this.version++}setUsage(e){return this.usage=e,this}addUpdateRange(e,t){this.updateRanges.push({start:e,count:t})}clearUpdateRanges(){this.updateRanges.length=0}copy(e){return this.array=new e.array.constructor(e.array),this.count=e.count,this.stride=e.stride,this.usage=e.usage,this}copyAt(e,t,n){e*=this.stride,n*=t.stride;for(let r=0,i=this.stride;r<i;r++)this.array[e+r]=t.array[n+r];return this}set(e,t=0){return this.array.set(e,t),this}clone(e){e.arrayBuffers===void 0&&(e.arrayBuffers={});let t=Bn(this.array);e.arrayBuffers[t]===void 0&&(e.arrayBuffers[t]=this.array.slice(0).buffer);let n=new this.array.constructor(e.arrayBuffers[t]),r=new this.constructor(n,this.stride);return r.setUsage(this.usage),r}onUpload(e){return this.onUploadCallback=e,this}toJSON(e){e.arrayBuffers===void 0&&(e.arrayBuffers={});let t=Bn(this.array);e.arrayBuffers[t]===void 0&&(e.arrayBuffers[t]=Array.from(new Uint32Array(this.array.slice(0).buffer)));let n={uuid:this.uuid,buffer:t,type:this.array.constructor.name,stride:this.stride};return n.usage=this.usage,n}};function Bn(a){return a.buffer._uuid===void 0&&(a.buffer._uuid=$()),a.byteOffset===0&&a.byteLength===a.buffer.byteLength?a.buffer._uuid:a.buffer._uuid+":"+a.byteOffset+":"+a.byteLength}import{Vector3 as Or}from"./three.js";import{BufferAttribute as Fr}from"./three.js";var C=new Or,le=class a{constructor(e,t,n,r=!1){this.isInterleavedBufferAttribute=!0,this.name="",this.data=e,this.itemSize=t,this.offset=n,this.normalized=r,this._normalizationScale=e!==void 0?He(e.array):void 0}get count(){return this.data.count}get array(){return this.data.array}set needsUpdate(e){this.data.needsUpdate=e}applyMatrix4(e){for(let t=0,n=this.data.count;t<n;t++)C.fromBufferAttribute(this,t),C.applyMatrix4(e),this.setXYZ(t,C.x,C.y,C.z);return this}applyNormalMatrix(e){for(let t=0,n=this.count;t<n;t++)C.fromBufferAttribute(this,t),C.applyNormalMatrix(e),this.setXYZ(t,C.x,C.y,C.z);return this}transformDirection(e){for(let t=0,n=this.count;t<n;t++)C.fromBufferAttribute(this,t),C.transformDirection(e),this.setXYZ(t,C.x,C.y,C.z);return this}getComponent(e,t){let n=this.array[e*this.data.stride+this.offset+t];return this.normalized&&(n=this._denormalize(n)),n}setComponent(e,t,n){return this.normalized&&(n=this._normalize(n)),this.data.array[e*this.data.stride+this.offset+t]=n,this}setX(e,t){return this.normalized&&(t=this._normalize(t)),this.data.array[e*this.data.stride+this.offset]=t,this}setY(e,t){return this.normalized&&(t=this._normalize(t)),this.data.array[e*this.data.stride+this.offset+1]=t,this}setZ(e,t){return this.normalized&&(t=this._normalize(t)),this.data.array[e*this.data.stride+this.offset+2]=t,this}setW(e,t){return this.normalized&&(t=this._normalize(t)),this.data.array[e*this.data.stride+this.offset+3]=t,this}getX(e){let t=this.data.array[e*this.data.stride+this.offset];return this.normalized&&(t=this._denormalize(t)),t}getY(e){let t=this.data.array[e*this.data.stride+this.offset+1];return this.normalized&&(t=this._denormalize(t)),t}getZ(e){let t=this.data.array[e*this.data.stride+this.offset+2];return this.normalized&&(t=this._denormalize(t)),t}getW(e){let t=this.data.array[e*this.data.stride+this.offset+3];return this.normalized&&(t=this._denormalize(t)),t}setXY(e,t,n){return e=e*this.data.stride+this.offset,this.normalized&&(t=this._normalize(t),n=this._normalize(n)),this.data.array[e+0]=t,this.data.array[e+1]=n,this}setXYZ(e,t,n,r){return e=e*this.data.stride+this.offset,this.normalized&&(t=this._normalize(t),n=this._normalize(n),r=this._normalize(r)),this.data.array[e+0]=t,this.data.array[e+1]=n,this.data.array[e+2]=r,this}setXYZW(e,t,n,r,i){return e=e*this.data.stride+this.offset,this.normalized&&(t=this._normalize(t),n=this._normalize(n),r=this._normalize(r),i=this._normalize(i)),this.data.array[e+0]=t,this.data.array[e+1]=n,this.data.array[e+2]=r,this.data.array[e+3]=i,this}clone(e){if(e===void 0){St("InterleavedBufferAttribute.clone(): Cloning an interleaved buffer attribute will de-interleave buffer data.");let t=[];for(let n=0;n<this.count;n++){let r=n*this.data.stride+this.offset;for(let i=0;i<this.itemSize;i++)t.push(this.data.array[r+i])}return new Fr(new this.array.constructor(t),this.itemSize,this.normalized)}else return e.interleavedBuffers===void 0&&(e.interleavedBuffers={}),e.interleavedBuffers[this.data.uuid]===void 0&&(e.interleavedBuffers[this.data.uuid]=this.data.clone(e)),new a(e.interleavedBuffers[this.data.uuid],this.itemSize,this.offset,this.normalized)}toJSON(e){if(e===void 0){St("InterleavedBufferAttribute.toJSON(): Serializing an interleaved buffer attribute will de-interleave buffer data.");let t=[];for(let n=0;n<this.count;n++){let r=n*this.data.stride+this.offset;for(let i=0;i<this.itemSize;i++)t.push(this.data.array[r+i])}return{itemSize:this.itemSize,type:this.array.constructor.name,array:t,normalized:this.normalized}}else return e.interleavedBuffers===void 0&&(e.interleavedBuffers={}),e.interleavedBuffers[this.data.uuid]===void 0&&(e.interleavedBuffers[this.data.uuid]=this.data.toJSON(e)),{isInterleavedBufferAttribute:!0,itemSize:this.itemSize,data:this.data.uuid,offset:this.offset,normalized:this.normalized}}_denormalize(e){let t=this._normalizationScale;return t!==void 0?Math.max(e/t,-1):Fn(e,this.data.array)}_normalize(e){let t=this._normalizationScale;return t!==void 0?Math.round(e*t):Hn(e,this.data.array)}};import{Mesh as Hr}from"./three.js";import{Box3 as Br}from"./three.js";import{Matrix4 as ke}from"./three.js";import{Sphere as Wn}from"./three.js";import{Vector3 as kr}from"./three.js";import{Vector4 as xe}from"./three.js";import{Ray as Vr}from"./three.js";var _e=new xe,kn=new xe,Vn=new xe,Gr=new xe,Gn=new ke,Be=new kr,Mt=new Wn,zn=new ke,Tt=new Vr,Se=class extends Hr{constructor(e,t){super(e,t),this.isSkinnedMesh=!0,this.type="SkinnedMesh",this.bindMode=ut,this.bindMatrix=new ke,this.bindMatrixInverse=new ke,this.boundingBox=null,this.boundingSphere=null}computeBoundingBox(){let e=this.geometry;this.boundingBox===null&&(this.boundingBox=new Br),this.boundingBox.makeEmpty();let t=e.getAttribute("position");for(let n=0;n<t.count;n++)this.getVertexPosition(n,Be),this.boundingBox.expandByPoint(Be)}computeBoundingSphere(){let e=this.geometry;this.boundingSphere===null&&(this.boundingSphere=new Wn),this.boundingSphere.makeEmpty();let t=e.getAttribute("position");for(let n=0;n<t.count;n++)this.getVertexPosition(n,Be),this.boundingSphere.expandByPoint(Be)}copy(e,t){return super.copy(e,t),this.bindMode=e.bindMode,this.bindMatrix.copy(e.bindMatrix),this.bindMatrixInverse.copy(e.bindMatrixInverse),this.skeleton=e.skeleton,this.boundingBox=e.boundingBox!==null?e.boundingBox.clone():null,this.boundingSphere=e.boundingSphere!==null?e.boundingSphere.clone():null,this}raycast(e,t){let n=this.material,r=this.matrixWorld;n!==void 0&&(this.boundingSphere===null&&this.computeBoundingSphere(),Mt.copy(this.boundingSphere),Mt.applyMatrix4(r),e.ray.intersectsSphere(Mt)!==!1&&(zn.copy(r).invert(),Tt.copy(e.ray).applyMatrix4(zn),!(this.boundingBox!==null&&Tt.intersectsBox(this.boundingBox)===!1)&&this._computeIntersections(e,t,Tt)))}getVertexPosition(e,t){return super.getVertexPosition(e,t),this.applyBoneTransform(e,t),t}bind(e,t){this.skeleton=e,t===void 0&&(this.updateMatrixWorld(!0),this.skeleton.calculateInverses(),t=this.matrixWorld),this.bindMatrix.copy(t),this.bindMatrixInverse.copy(t).invert()}pose(){this.skeleton.pose()}normalizeSkinWeights(){let e=new xe,t=this.geometry.attributes.skinWeight;for(let n=0,r=t.count;n<r;n++){e.fromBufferAttribute(t,n);let i=1/e.manhattanLength();i!==1/0?e.multiplyScalar(i):e.set(1,0,0,0),t.setXYZW(n,e.x,e.y,e.z,e.w)}}updateMatrixWorld(e){super.updateMatrixWorld(e),this.bindMode===ut?this.bindMatrixInverse.copy(this.matrixWorld).invert():this.bindMode===Sn?this.bindMatrixInverse.copy(this.bindMatrix).invert():L("SkinnedMesh: Unrecognized bindMode: "+this.bindMode)}applyBoneTransform(e,t){let n=this.skeleton,r=this.geometry;kn.fromBufferAttribute(r.attributes.skinIndex,e),Vn.fromBufferAttribute(r.attributes.skinWeight,e),t.isVector4?(_e.copy(t),t.set(0,0,0,0)):(_e.set(t.x,t.y,t.z,1),t.set(0,0,0)),_e.applyMatrix4(this.bindMatrix);for(let i=0;i<4;i++){let o=Vn.getComponent(i);if(o!==0){let s=kn.getComponent(i);Gn.multiplyMatrices(n.bones[s].matrixWorld,n.boneInverses[s]),t.addScaledVector(Gr.copy(_e).applyMatrix4(Gn),o)}}return t.isVector4&&(t.w=_e.w),t.applyMatrix4(this.bindMatrixInverse)}};import{Object3D as zr}from"./three.js";var Q=class extends zr{constructor(){super(),this.isBone=!0,this.type="Bone"}};import{Matrix4 as Me}from"./three.js";import{DataTexture as Wr}from"./three.js";var Xn=new Me,Xr=new Me,Te=class a{constructor(e=[],t=[]){this.uuid=$(),this.bones=e.slice(0),this.boneInverses=t,this.boneMatrices=null,this.previousBoneMatrices=null,this.boneTexture=null,this.previousBoneTexture=null,this.init()}init(){let e=this.bones,t=this.boneInverses;if(this.boneMatrices=new Float32Array(e.length*16),t.length===0)this.calculateInverses();else if(e.length!==t.length){L("Skeleton: Number of inverse bone matrices does not match amount of bones."),this.boneInverses=[];for(let n=0,r=this.bones.length;n<r;n++)this.boneInverses.push(new Me)}}calculateInverses(){this.boneInverses.length=0;for(let e=0,t=this.bones.length;e<t;e++){let n=new Me;this.bones[e]&&n.copy(this.bones[e].matrixWorld).invert(),this.boneInverses.push(n)}}pose(){for(let e=0,t=this.bones.length;e<t;e++){let n=this.bones[e];n&&n.matrixWorld.copy(this.boneInverses[e]).invert()}for(let e=0,t=this.bones.length;e<t;e++){let n=this.bones[e];n&&(n.parent&&n.parent.isBone?(n.matrix.copy(n.parent.matrixWorld).invert(),n.matrix.multiply(n.matrixWorld)):n.matrix.copy(n.matrixWorld),n.matrix.decompose(n.position,n.quaternion,n.scale))}}update(){let e=this.bones,t=this.boneInverses,n=this.boneMatrices,r=this.boneTexture;for(let i=0,o=e.length;i<o;i++){let s=e[i]?e[i].matrixWorld:Xr;Xn.multiplyMatrices(s,t[i]),Xn.toArray(n,i*16)}r!==null&&(r.needsUpdate=!0)}clone(){return new a(this.bones,this.boneInverses)}computeBoneTexture(){let e=Math.sqrt(this.bones.length*4);e=Math.ceil(e/4)*4,e=Math.max(e,4);let t=new Float32Array(e*e*4);t.set(this.boneMatrices);let n=new Wr(t,e,e,In,Nn);return n.needsUpdate=!0,this.boneMatrices=t,this.boneTexture=n,this}getBoneByName(e){for(let t=0,n=this.bones.length;t<n;t++){let r=this.bones[t];if(r.name===e)return r}}dispose(){this.boneTexture!==null&&(this.boneTexture.dispose(),this.boneTexture=null),this.previousBoneTexture!==null&&(this.previousBoneTexture.dispose(),this.previousBoneTexture=null)}fromJSON(e,t){this.uuid=e.uuid;for(let n=0,r=e.bones.length;n<r;n++){let i=e.bones[n],o=t[i];o===void 0&&(L("Skeleton: No bone found with UUID:",i),o=new Q),this.bones.push(o),this.boneInverses.push(new Me().fromArray(e.boneInverses[n]))}return this.init(),this}toJSON(){let e={metadata:{version:4.7,type:"Skeleton",generator:"Skeleton.toJSON"},bones:[],boneInverses:[]};e.uuid=this.uuid;let t=this.bones,n=this.boneInverses;for(let r=0,i=t.length;r<i;r++){let o=t[r];e.bones.push(o.uuid);let s=n[r];e.boneInverses.push(s.toArray())}return e}};import{Line as jr}from"./three.js";var ye=class extends jr{constructor(e,t){super(e,t),this.isLineLoop=!0,this.type="LineLoop"}};import{Material as Kr}from"./three.js";import{Color as qr}from"./three.js";var Ee=class extends Kr{constructor(e){super(),this.isPointsMaterial=!0,this.type="PointsMaterial",this.color=new qr(16777215),this.map=null,this.alphaMap=null,this.size=1,this.sizeAttenuation=!0,this.fog=!0,this.setValues(e)}copy(e){return super.copy(e),this.color.copy(e.color),this.map=e.map,this.alphaMap=e.alphaMap,this.size=e.size,this.sizeAttenuation=e.sizeAttenuation,this.fog=e.fog,this}};import{Vector2 as Yr}from"./three.js";import{MeshStandardMaterial as Zr}from"./three.js";import{Color as yt}from"./three.js";var P=class extends Zr{constructor(e){super(),this.isMeshPhysicalMaterial=!0,this.defines={STANDARD:"",PHYSICAL:""},this.type="MeshPhysicalMaterial",this.anisotropyRotation=0,this.anisotropyMap=null,this.clearcoatMap=null,this.clearcoatRoughness=0,this.clearcoatRoughnessMap=null,this.clearcoatNormalScale=new Yr(1,1),this.clearcoatNormalMap=null,this.diffuseRoughnessMap=null,this.ior=1.5,Object.defineProperty(this,"reflectivity",{get:function(){return On(2.5*(this.ior-1)/(this.ior+1),0,1)},set:function(t){this.ior=(1+.4*t)/(1-.4*t)}}),this.iridescenceMap=null,this.iridescenceIOR=1.3,this.iridescenceThicknessMinimum=100,this.iridescenceThicknessMaximum=400,this.iridescenceThicknessMap=null,this.sheenColor=new yt(0),this.sheenColorMap=null,this.sheenRoughness=1,this.sheenRoughnessMap=null,this.transmissionMap=null,this.thickness=0,this.thicknessMap=null,this.attenuationDistance=1/0,this.attenuationColor=new yt(1,1,1),this.specularIntensity=1,this.specularIntensityMap=null,this.specularColor=new yt(1,1,1),this.specularColorMap=null,this._anisotropy=0,this._clearcoat=0,this._diffuseRoughness=0,this._dispersion=0,this._iridescence=0,this._retroreflectivity=0,this._sheen=0,this._transmission=0,this.setValues(e)}get anisotropy(){return this._anisotropy}set anisotropy(e){this._anisotropy>0!=e>0&&this.version++,this._anisotropy=e}get clearcoat(){return this._clearcoat}set clearcoat(e){this._clearcoat>0!=e>0&&this.version++,this._clearcoat=e}get diffuseRoughness(){return this._diffuseRoughness}set diffuseRoughness(e){this._diffuseRoughness>0!=e>0&&this.version++,this._diffuseRoughness=e}get iridescence(){return this._iridescence}set iridescence(e){this._iridescence>0!=e>0&&this.version++,this._iridescence=e}get dispersion(){return this._dispersion}set dispersion(e){this._dispersion>0!=e>0&&this.version++,this._dispersion=e}get retroreflectivity(){return this._retroreflectivity}set retroreflectivity(e){this._retroreflectivity>0!=e>0&&this.version++,this._retroreflectivity=e}get sheen(){return this._sheen}set sheen(e){this._sheen>0!=e>0&&this.version++,this._sheen=e}get transmission(){return this._transmission}set transmission(e){this._transmission>0!=e>0&&this.version++,this._transmission=e}get iridescenceThicknessRange(){return xt('MeshPhysicalMaterial: The "iridescenceThicknessRange" property has been replaced by "iridescenceThicknessMinimum" and "iridescenceThicknessMaximum".'),[this.iridescenceThicknessMinimum,this.iridescenceThicknessMaximum]}set iridescenceThicknessRange(e){xt('MeshPhysicalMaterial: The "iridescenceThicknessRange" property has been replaced by "iridescenceThicknessMinimum" and "iridescenceThicknessMaximum".'),this.iridescenceThicknessMinimum=e[0],this.iridescenceThicknessMaximum=e[1]}copy(e){return super.copy(e),this.defines={STANDARD:"",PHYSICAL:""},this.anisotropy=e.anisotropy,this.anisotropyRotation=e.anisotropyRotation,this.anisotropyMap=e.anisotropyMap,this.clearcoat=e.clearcoat,this.clearcoatMap=e.clearcoatMap,this.clearcoatRoughness=e.clearcoatRoughness,this.clearcoatRoughnessMap=e.clearcoatRoughnessMap,this.clearcoatNormalMap=e.clearcoatNormalMap,this.clearcoatNormalScale.copy(e.clearcoatNormalScale),this.diffuseRoughness=e.diffuseRoughness,this.diffuseRoughnessMap=e.diffuseRoughnessMap,this.dispersion=e.dispersion,this.ior=e.ior,this.iridescence=e.iridescence,this.iridescenceMap=e.iridescenceMap,this.iridescenceIOR=e.iridescenceIOR,this.iridescenceThicknessMinimum=e.iridescenceThicknessMinimum,this.iridescenceThicknessMaximum=e.iridescenceThicknessMaximum,this.iridescenceThicknessMap=e.iridescenceThicknessMap,this.retroreflectivity=e.retroreflectivity,this.sheen=e.sheen,this.sheenColor.copy(e.sheenColor),this.sheenColorMap=e.sheenColorMap,this.sheenRoughness=e.sheenRoughness,this.sheenRoughnessMap=e.sheenRoughnessMap,this.transmission=e.transmission,this.transmissionMap=e.transmissionMap,this.thickness=e.thickness,this.thicknessMap=e.thicknessMap,this.attenuationDistance=e.attenuationDistance,this.attenuationColor.copy(e.attenuationColor),this.specularIntensity=e.specularIntensity,this.specularIntensityMap=e.specularIntensityMap,this.specularColor.copy(e.specularColor),this.specularColorMap=e.specularColorMap,this}};function B(a,e){return!a||a.constructor===e?a:typeof e.BYTES_PER_ELEMENT=="number"?new e(a):Array.prototype.slice.call(a)}function ee(a){return a!==void 0&&a.inTangents!==void 0&&a.outTangents!==void 0}function jn(a){function e(r,i){return a[r]-a[i]}let t=a.length,n=new Array(t);for(let r=0;r!==t;++r)n[r]=r;return n.sort(e),n}function Et(a,e,t){let n=a.length,r=new a.constructor(n);for(let i=0,o=0;o!==n;++i){let s=t[i]*e;for(let c=0;c!==e;++c)r[o++]=a[s+c]}return r}function Kn(a,e,t,n){let r=1,i=a[0];for(;i!==void 0&&i[n]===void 0;)i=a[r++];if(i===void 0)return;let o=i[n];if(o!==void 0)if(Array.isArray(o))do o=i[n],o!==void 0&&(e.push(i.time),t.push(...o)),i=a[r++];while(i!==void 0);else if(o.toArray!==void 0)do o=i[n],o!==void 0&&(e.push(i.time),o.toArray(t,t.length)),i=a[r++];while(i!==void 0);else do o=i[n],o!==void 0&&(e.push(i.time),t.push(o)),i=a[r++];while(i!==void 0)}var D=class{constructor(e,t,n,r){this.parameterPositions=e,this._cachedIndex=0,this.resultBuffer=r!==void 0?r:new t.constructor(n),this.sampleValues=t,this.valueSize=n,this.settings=null,this.DefaultSettings_={}}evaluate(e){let t=this.parameterPositions,n=this._cachedIndex,r=t[n],i=t[n-1];n:{e:{let o;t:{r:if(!(e<r)){for(let s=n+2;;){if(r===void 0){if(e<i)break r;return n=t.length,this._cachedIndex=n,this.copySampleValue_(n-1)}if(n===s)break;if(i=r,r=t[++n],e<r)break e}o=t.length;break t}if(!(e>=i)){let s=t[1];e<s&&(n=2,i=s);for(let c=n-2;;){if(i===void 0)return this._cachedIndex=0,this.copySampleValue_(0);if(n===c)break;if(r=i,i=t[--n-1],e>=i)break e}o=n,n=0;break t}break n}for(;n<o;){let s=n+o>>>1;e<t[s]?o=s:n=s+1}if(r=t[n],i=t[n-1],i===void 0)return this._cachedIndex=0,this.copySampleValue_(0);if(r===void 0)return n=t.length,this._cachedIndex=n,this.copySampleValue_(n-1)}this._cachedIndex=n,this.intervalChanged_(n,i,r)}return this.interpolate_(n,i,e,r)}getSettings_(){return this.settings||this.DefaultSettings_}copySampleValue_(e){let t=this.resultBuffer,n=this.sampleValues,r=this.valueSize,i=e*r;for(let o=0;o!==r;++o)t[o]=n[i+o];return t}interpolate_(){throw new Error("THREE.Interpolant: Call to abstract method.")}intervalChanged_(){}};var Ve=class extends D{constructor(e,t,n,r){super(e,t,n,r),this._weightPrev=-0,this._offsetPrev=-0,this._weightNext=-0,this._offsetNext=-0,this.DefaultSettings_={endingStart:mt,endingEnd:mt}}intervalChanged_(e,t,n){let r=this.parameterPositions,i=e-2,o=e+1,s=r[i],c=r[o];if(s===void 0)switch(this.getSettings_().endingStart){case gt:i=e,s=2*t-n;break;case vt:i=r.length-2,s=t+r[i]-r[i+1];break;default:i=e,s=n}if(c===void 0)switch(this.getSettings_().endingEnd){case gt:o=e,c=2*n-t;break;case vt:o=1,c=n+r[1]-r[0];break;default:o=e-1,c=t}let l=(n-t)*.5,f=this.valueSize;this._weightPrev=l/(t-s),this._weightNext=l/(c-n),this._offsetPrev=i*f,this._offsetNext=o*f}interpolate_(e,t,n,r){let i=this.resultBuffer,o=this.sampleValues,s=this.valueSize,c=e*s,l=c-s,f=this._offsetPrev,d=this._offsetNext,u=this._weightPrev,h=this._weightNext,p=(n-t)/(r-t),g=p*p,m=g*p,v=-u*m+2*u*g-u*p,y=(1+u)*m+(-1.5-2*u)*g+(-.5+u)*p+1,M=(-1-h)*m+(1.5+h)*g+.5*p,S=h*m-h*g;for(let x=0;x!==s;++x)i[x]=v*o[f+x]+y*o[l+x]+M*o[c+x]+S*o[d+x];return i}};var Ge=class extends D{constructor(e,t,n,r){super(e,t,n,r)}interpolate_(e,t,n,r){let i=this.resultBuffer,o=this.sampleValues,s=this.valueSize,c=e*s,l=c-s,f=(n-t)/(r-t),d=1-f;for(let u=0;u!==s;++u)i[u]=o[l+u]*d+o[c+u]*f;return i}};var ze=class extends D{constructor(e,t,n,r){super(e,t,n,r)}interpolate_(e){return this.copySampleValue_(e-1)}};var We=class extends D{interpolate_(e,t,n,r){let i=this.resultBuffer,o=this.sampleValues,s=this.valueSize,c=e*s,l=c-s,f=this.inTangents,d=this.outTangents;if(!f||!d){let p=(n-t)/(r-t),g=1-p;for(let m=0;m!==s;++m)i[m]=o[l+m]*g+o[c+m]*p;return i}let u=s*2,h=e-1;for(let p=0;p!==s;++p){let g=o[l+p],m=o[c+p],v=h*u+p*2,y=d[v],M=d[v+1],S=e*u+p*2,x=f[S],N=f[S+1],T=$r(n,t,y,x,r);i[p]=Yn(T,g,M,N,m)}return i}};function Yn(a,e,t,n,r){let i=1-a;return i*i*i*e+3*i*i*a*t+3*i*a*a*n+a*a*a*r}function Jr(a,e,t,n,r){let i=1-a;return 3*i*i*(t-e)+6*i*a*(n-t)+3*a*a*(r-n)}function $r(a,e,t,n,r){let i=(a-e)/(r-e);for(let o=0;o<8;o++){let s=Yn(i,e,t,n,r)-a;if(Math.abs(s)<1e-10)break;let c=Jr(i,e,t,n,r);if(Math.abs(c)<1e-10)break;i=Math.max(0,Math.min(1,i-s/c))}return i}var I=class{constructor(e,t,n,r){if(e===void 0)throw new Error("THREE.KeyframeTrack: track name is undefined");if(t===void 0||t.length===0)throw new Error("THREE.KeyframeTrack: no keyframes in track named "+e);this.name=e,this.times=B(t,this.TimeBufferType),this.values=B(n,this.ValueBufferType),this.setInterpolation(r||this.DefaultInterpolation)}static toJSON(e){let t=e.constructor,n;if(t.toJSON!==this.toJSON)n=t.toJSON(e);else{n={name:e.name,times:B(e.times,Array),values:B(e.values,Array)};let r=e.getInterpolation();r!==e.DefaultInterpolation&&(n.interpolation=r),ee(e.settings)&&(n.settings={inTangents:B(e.settings.inTangents,Array),outTangents:B(e.settings.outTangents,Array)})}return n.type=e.ValueTypeName,n}InterpolantFactoryMethodDiscrete(e){return new ze(this.times,this.values,this.getValueSize(),e)}InterpolantFactoryMethodLinear(e){return new Ge(this.times,this.values,this.getValueSize(),e)}InterpolantFactoryMethodSmooth(e){return new Ve(this.times,this.values,this.getValueSize(),e)}InterpolantFactoryMethodBezier(e){let t=new We(this.times,this.values,this.getValueSize(),e);return this.settings&&(t.inTangents=this.settings.inTangents,t.outTangents=this.settings.outTangents),t}setInterpolation(e){let t;switch(e){case z:t=this.InterpolantFactoryMethodDiscrete;break;case J:t=this.InterpolantFactoryMethodLinear;break;case Oe:t=this.InterpolantFactoryMethodSmooth;break;case pt:t=this.InterpolantFactoryMethodBezier;break}if(t===void 0){let n="unsupported interpolation for "+this.ValueTypeName+" keyframe track named "+this.name;if(this.createInterpolant===void 0)if(e!==this.DefaultInterpolation)this.setInterpolation(this.DefaultInterpolation);else throw new Error(n);return L("KeyframeTrack:",n),this}return this.createInterpolant=t,this}getInterpolation(){switch(this.createInterpolant){case this.InterpolantFactoryMethodDiscrete:return z;case this.InterpolantFactoryMethodLinear:return J;case this.InterpolantFactoryMethodSmooth:return Oe;case this.InterpolantFactoryMethodBezier:return pt}}getValueSize(){return this.values.length/this.times.length}shift(e){if(e!==0){let t=this.times;for(let n=0,r=t.length;n!==r;++n)t[n]+=e;ee(this.settings)&&(Zn(this.settings.inTangents,e),Zn(this.settings.outTangents,e))}return this}scale(e){if(e!==1){let t=this.times;for(let n=0,r=t.length;n!==r;++n)t[n]*=e;ee(this.settings)&&(Jn(this.settings.inTangents,e),Jn(this.settings.outTangents,e))}return this}trim(e,t){let n=this.times,r=n.length,i=0,o=r-1;for(;i!==r&&n[i]<e;)++i;for(;o!==-1&&n[o]>t;)--o;if(++o,i!==0||o!==r){i>=o&&(o=Math.max(o,1),i=o-1);let s=this.getValueSize();this.times=n.slice(i,o),this.values=this.values.slice(i*s,o*s)}return this}validate(){let e=!0,t=this.getValueSize();t-Math.floor(t)!==0&&(R("KeyframeTrack: Invalid value size in track.",this),e=!1);let n=this.times,r=this.values,i=n.length;i===0&&(R("KeyframeTrack: Track is empty.",this),e=!1);let o=null;for(let s=0;s!==i;s++){let c=n[s];if(typeof c=="number"&&isNaN(c)){R("KeyframeTrack: Time is not a valid number.",this,s,c),e=!1;break}if(o!==null&&o>c){R("KeyframeTrack: Out of order keys.",this,s,c,o),e=!1;break}o=c}if(r!==void 0&&_t(r))for(let s=0,c=r.length;s!==c;++s){let l=r[s];if(isNaN(l)){R("KeyframeTrack: Value is not a valid number.",this,s,l),e=!1;break}}return e}optimize(){let e=this.times.slice(),t=this.values.slice(),n=this.getValueSize(),r=this.getInterpolation()===Oe,i=e.length-1,o=1;for(let s=1;s<i;++s){let c=!1,l=e[s],f=e[s+1];if(l!==f&&(s!==1||l!==e[0]))if(r)c=!0;else{let d=s*n,u=d-n,h=d+n;for(let p=0;p!==n;++p){let g=t[d+p];if(g!==t[u+p]||g!==t[h+p]){c=!0;break}}}if(c){if(s!==o){e[o]=e[s];let d=s*n,u=o*n;for(let h=0;h!==n;++h)t[u+h]=t[d+h]}++o}}if(i>0){e[o]=e[i];for(let s=i*n,c=o*n,l=0;l!==n;++l)t[c+l]=t[s+l];++o}return o!==e.length?(this.times=e.slice(0,o),this.values=t.slice(0,o*n)):(this.times=e,this.values=t),this}clone(){let e=this.times.slice(),t=this.values.slice(),n=this.constructor,r=new n(this.name,e,t);return r.createInterpolant=this.createInterpolant,ee(this.settings)&&(r.settings={inTangents:this.settings.inTangents.slice(),outTangents:this.settings.outTangents.slice()}),r}};function Zn(a,e){for(let t=0,n=a.length;t!==n;t+=2)a[t]+=e}function Jn(a,e){for(let t=0,n=a.length;t!==n;t+=2)a[t]*=e}I.prototype.ValueTypeName="";I.prototype.TimeBufferType=Float32Array;I.prototype.ValueBufferType=Float32Array;I.prototype.DefaultInterpolation=J;var W=class extends I{constructor(e,t,n){super(e,t,n)}};W.prototype.ValueTypeName="bool";W.prototype.ValueBufferType=Array;W.prototype.DefaultInterpolation=z;W.prototype.InterpolantFactoryMethodLinear=void 0;W.prototype.InterpolantFactoryMethodSmooth=void 0;var Ae=class extends I{constructor(e,t,n,r){super(e,t,n,r)}};Ae.prototype.ValueTypeName="color";var U=class extends I{constructor(e,t,n,r){super(e,t,n,r)}};U.prototype.ValueTypeName="number";import{Quaternion as Qr}from"./three.js";var Xe=class extends D{constructor(e,t,n,r){super(e,t,n,r)}interpolate_(e,t,n,r){let i=this.resultBuffer,o=this.sampleValues,s=this.valueSize,c=(n-t)/(r-t),l=e*s;for(let f=l+s;l!==f;l+=4)Qr.slerpFlat(i,0,o,l-s,o,l,c);return i}};var k=class extends I{constructor(e,t,n,r){super(e,t,n,r)}InterpolantFactoryMethodLinear(e){return new Xe(this.times,this.values,this.getValueSize(),e)}};k.prototype.ValueTypeName="quaternion";k.prototype.InterpolantFactoryMethodSmooth=void 0;var X=class extends I{constructor(e,t,n){super(e,t,n)}};X.prototype.ValueTypeName="string";X.prototype.ValueBufferType=Array;X.prototype.DefaultInterpolation=z;X.prototype.InterpolantFactoryMethodLinear=void 0;X.prototype.InterpolantFactoryMethodSmooth=void 0;var j=class extends I{constructor(e,t,n,r){super(e,t,n,r)}};j.prototype.ValueTypeName="vector";var te=class{constructor(e="",t=-1,n=[],r=wn){this.name=e,this.tracks=n,this.duration=t,this.blendMode=r,this.uuid=$(),this.userData={},this.duration<0&&this.resetDuration()}static parse(e){let t=[],n=e.tracks,r=1/(e.fps||1);for(let o=0,s=n.length;o!==s;++o)t.push(ti(n[o]).scale(r));let i=new this(e.name,e.duration,t,e.blendMode);return i.uuid=e.uuid,i.userData=JSON.parse(e.userData||"{}"),i}static toJSON(e){let t=[],n=e.tracks,r={name:e.name,duration:e.duration,tracks:t,uuid:e.uuid,blendMode:e.blendMode,userData:JSON.stringify(e.userData)};for(let i=0,o=n.length;i!==o;++i)t.push(I.toJSON(n[i]));return r}static CreateFromMorphTargetSequence(e,t,n,r){let i=t.length,o=[];for(let s=0;s<i;s++){let c=[],l=[];c.push((s+i-1)%i,s,(s+1)%i),l.push(0,1,0);let f=jn(c);c=Et(c,1,f),l=Et(l,1,f),!r&&c[0]===0&&(c.push(i),l.push(l[0])),o.push(new U(".morphTargetInfluences["+t[s].name+"]",c,l).scale(1/n))}return new this(e,-1,o)}static findByName(e,t){let n=e;if(!Array.isArray(e)){let r=e;n=r.geometry&&r.geometry.animations||r.animations}for(let r=0;r<n.length;r++)if(n[r].name===t)return n[r];return null}static CreateClipsFromMorphTargetSequences(e,t,n){let r={},i=/^([\w-]*?)([\d]+)$/;for(let s=0,c=e.length;s<c;s++){let l=e[s],f=l.name.match(i);if(f&&f.length>1){let d=f[1],u=r[d];u||(r[d]=u=[]),u.push(l)}}let o=[];for(let s in r)o.push(this.CreateFromMorphTargetSequence(s,r[s],t,n));return o}resetDuration(){let e=this.tracks,t=0;for(let n=0,r=e.length;n!==r;++n){let i=this.tracks[n];t=Math.max(t,i.times[i.times.length-1])}return this.duration=t,this}trim(){for(let e=0;e<this.tracks.length;e++)this.tracks[e].trim(0,this.duration);return this}validate(){let e=!0;for(let t=0;t<this.tracks.length;t++)e=e&&this.tracks[t].validate();return e}optimize(){for(let e=0;e<this.tracks.length;e++)this.tracks[e].optimize();return this}clone(){let e=[];for(let n=0;n<this.tracks.length;n++)e.push(this.tracks[n].clone());let t=new this.constructor(this.name,this.duration,e,this.blendMode);return t.userData=JSON.parse(JSON.stringify(this.userData)),t}toJSON(){return this.constructor.toJSON(this)}};function ei(a){switch(a.toLowerCase()){case"scalar":case"double":case"float":case"number":case"integer":return U;case"vector":case"vector2":case"vector3":case"vector4":return j;case"color":return Ae;case"quaternion":return k;case"bool":case"boolean":return W;case"string":return X}throw new Error("THREE.KeyframeTrack: Unsupported typeName: "+a)}function ti(a){if(a.type===void 0)throw new Error("THREE.KeyframeTrack: track type undefined, can not parse");let e=ei(a.type);if(a.times===void 0){let n=[],r=[];Kn(a.keys,n,r,"value"),a.times=n,a.values=r}let t;return e.parse!==void 0?t=e.parse(a):t=new e(a.name,a.times,a.values,a.interpolation),ee(a.settings)&&(t.settings={inTangents:B(a.settings.inTangents,Float32Array),outTangents:B(a.settings.outTangents,Float32Array)}),t}var O={enabled:!1,files:{},add:function(a,e){this.enabled!==!1&&($n(a)||(this.files[a]=e))},get:function(a){if(this.enabled!==!1&&!$n(a))return this.files[a]},remove:function(a){delete this.files[a]},clear:function(){this.files={}}};function $n(a){try{let e=a.slice(a.indexOf(":")+1);return new URL(e).protocol==="blob:"}catch{return!1}}import{Loader as ni}from"./three.js";var K={},At=class extends Error{constructor(e,t){super(e),this.response=t}},fe=class extends ni{constructor(e){super(e),this.mimeType="",this.responseType="",this._abortController=new AbortController}load(e,t,n,r){e===void 0&&(e=""),this.path!==void 0&&(e=this.path+e),e=this.manager.resolveURL(e);let i=O.get(`file:${e}`);if(i!==void 0){this.manager.itemStart(e),setTimeout(()=>{t&&t(i),this.manager.itemEnd(e)},0);return}if(K[e]!==void 0){K[e].push({onLoad:t,onProgress:n,onError:r});return}K[e]=[],K[e].push({onLoad:t,onProgress:n,onError:r});let o=new Request(e,{headers:new Headers(this.requestHeader),credentials:this.withCredentials?"include":"same-origin",priority:this.priority,cache:this.cache,signal:typeof AbortSignal.any=="function"?AbortSignal.any([this._abortController.signal,this.manager.abortController.signal]):this._abortController.signal}),s=this.mimeType,c=this.responseType;fetch(o).then(l=>{if(l.status===200||l.status===0){if(l.status===0&&L("FileLoader: HTTP Status 0 received."),typeof ReadableStream>"u"||l.body===void 0||l.body.getReader===void 0)return l;let f=K[e],d=l.body.getReader(),u=l.headers.get("X-File-Size")||l.headers.get("Content-Length"),h=u?parseInt(u):0,p=h!==0,g=0,m=new ReadableStream({start(v){y();function y(){d.read().then(({done:M,value:S})=>{if(M)v.close();else{g+=S.byteLength;let x=new ProgressEvent("progress",{lengthComputable:p,loaded:g,total:h});for(let N=0,T=f.length;N<T;N++){let w=f[N];w.onProgress&&w.onProgress(x)}v.enqueue(S),y()}},M=>{v.error(M)})}}});return new Response(m)}else throw new At(`fetch for "${l.url}" responded with ${l.status}: ${l.statusText}`,l)}).then(l=>{switch(c){case"arraybuffer":return l.arrayBuffer();case"blob":return l.blob();case"document":return l.text().then(f=>new DOMParser().parseFromString(f,s));case"json":return l.json();default:if(s==="")return l.text();{let d=/charset="?([^;"\s]*)"?/i.exec(s),u=d&&d[1]?d[1].toLowerCase():void 0,h=new TextDecoder(u);return l.arrayBuffer().then(p=>h.decode(p))}}}).then(l=>{O.add(`file:${e}`,l);let f=K[e];delete K[e];for(let d=0,u=f.length;d<u;d++){let h=f[d];h.onLoad&&h.onLoad(l)}}).catch(l=>{let f=K[e];if(f===void 0)throw this.manager.itemError(e),l;delete K[e];for(let d=0,u=f.length;d<u;d++){let h=f[d];h.onError&&h.onError(l)}this.manager.itemError(e)}).finally(()=>{this.manager.itemEnd(e)}),this.manager.itemStart(e)}setResponseType(e){return this.responseType=e,this}setMimeType(e){return this.mimeType=e,this}abort(){return this._abortController.abort(),this._abortController=new AbortController,this}};import{Loader as ri}from"./three.js";var de=new WeakMap,je=class extends ri{constructor(e){super(e)}load(e,t,n,r){this.path!==void 0&&(e=this.path+e),e=this.manager.resolveURL(e);let i=this,o=O.get(`image:${e}`);if(o!==void 0){if(o.complete===!0)i.manager.itemStart(e),setTimeout(function(){t&&t(o),i.manager.itemEnd(e)},0);else{let d=de.get(o);d===void 0&&(d=[],de.set(o,d)),d.push({onLoad:t,onError:r})}return o}let s=Pn("img");function c(){f(),t&&t(this);let d=de.get(this)||[];for(let u=0;u<d.length;u++){let h=d[u];h.onLoad&&h.onLoad(this)}de.delete(this),i.manager.itemEnd(e)}function l(d){f(),r&&r(d),O.remove(`image:${e}`);let u=de.get(this)||[];for(let h=0;h<u.length;h++){let p=u[h];p.onError&&p.onError(d)}de.delete(this),i.manager.itemError(e),i.manager.itemEnd(e)}function f(){s.removeEventListener("load",c,!1),s.removeEventListener("error",l,!1)}return s.addEventListener("load",c,!1),s.addEventListener("error",l,!1),e.slice(0,5)!=="data:"&&this.crossOrigin!==void 0&&(s.crossOrigin=this.crossOrigin),O.add(`image:${e}`,s),i.manager.itemStart(e),s.fetchPriority=this.priority,s.src=e,s}};import{Texture as ii}from"./three.js";import{Loader as oi}from"./three.js";var ne=class extends oi{constructor(e){super(e)}load(e,t,n,r){let i=new ii,o=new je(this.manager);return o.setPriority(this.priority),o.setCache(this.cache),o.setCrossOrigin(this.crossOrigin),o.setPath(this.path),o.load(e,function(s){i.image=s,i.needsUpdate=!0,t!==void 0&&t(i)},n,r),i}};import{Object3D as ai}from"./three.js";import{Color as si}from"./three.js";var ue=class extends ai{static registerNode(e){this.prototype._lightNode=e}constructor(e,t=1){super(),this.isLight=!0,this.type="Light",this.color=new si(e),this.intensity=t}copy(e,t){return super.copy(e,t),this.color.copy(e.color),this.intensity=e.intensity,this}toJSON(e){let t=super.toJSON(e);return t.object.color=this.color.getHex(),t.object.intensity=this.intensity,t}};import{Matrix4 as nr}from"./three.js";import{Vector2 as Qn}from"./three.js";import{Vector3 as rr}from"./three.js";import{Vector4 as ci}from"./three.js";import{Frustum as li}from"./three.js";var Nt=new nr,er=new rr,tr=new rr,he=class{constructor(e){this.camera=e,this.intensity=1,this.bias=0,this.biasNode=null,this.normalBias=0,this.radius=1,this.blurSamples=8,this.mapSize=new Qn(512,512),this.mapType=An,this.map=null,this.mapPass=null,this.matrix=new nr,this.autoUpdate=!0,this.needsUpdate=!1,this._frustum=new li,this._frameExtents=new Qn(1,1),this._viewportCount=1,this._viewports=[new ci(0,0,1,1)]}getViewportCount(){return this._viewportCount}getCamera(){return this.camera}getFrustum(){return this._frustum}updateMatrices(e){let t=this.camera;er.setFromMatrixPosition(e.matrixWorld),t.position.copy(er),tr.setFromMatrixPosition(e.target.matrixWorld),t.lookAt(tr),t.updateMatrixWorld(),this._updateMatrix(t,this.matrix,this._frustum)}_updateMatrix(e,t,n,r){Nt.multiplyMatrices(e.projectionMatrix,e.matrixWorldInverse),n.setFromProjectionMatrix(Nt,e.coordinateSystem,e.reversedDepth);let i=this._frameExtents,o=r?r.z/i.x:1,s=r?r.w/i.y:1,c=r?r.x/i.x:0,l=r?r.y/i.y:0;e.coordinateSystem===Ln||e.reversedDepth?t.set(.5*o,0,0,.5*o+c,0,.5*s,0,.5*s+l,0,0,1,0,0,0,0,1):t.set(.5*o,0,0,.5*o+c,0,.5*s,0,.5*s+l,0,0,.5,.5,0,0,0,1),t.multiply(Nt)}getViewport(e){return this._viewports[e]}getFrameExtents(){return this._frameExtents}dispose(){this.map&&this.map.dispose(),this.mapPass&&this.mapPass.dispose()}copy(e){return this.camera=e.camera.clone(),this.intensity=e.intensity,this.bias=e.bias,this.radius=e.radius,this.autoUpdate=e.autoUpdate,this.needsUpdate=e.needsUpdate,this.normalBias=e.normalBias,this.blurSamples=e.blurSamples,this.mapSize.copy(e.mapSize),this.mapType=e.mapType,this.biasNode=e.biasNode,this}clone(){return new this.constructor().copy(this)}toJSON(){let e={};return e.intensity=this.intensity,e.bias=this.bias,e.normalBias=this.normalBias,e.radius=this.radius,e.blurSamples=this.blurSamples,e.mapSize=this.mapSize.toArray(),e.mapType=this.mapType,e.camera=this.camera.toJSON(!1).object,delete e.camera.matrix,e}};import{PerspectiveCamera as fi}from"./three.js";var Ke=class extends he{constructor(){super(new fi(50,1,.5,500)),this.isSpotLightShadow=!0,this.focus=1,this.aspect=1}updateMatrices(e){let t=this.camera,n=Un*2*e.angle*this.focus,r=this.mapSize.width/this.mapSize.height*this.aspect,i=e.distance||t.far;(n!==t.fov||r!==t.aspect||i!==t.far)&&(t.fov=n,t.aspect=r,t.far=i,t.updateProjectionMatrix()),super.updateMatrices(e)}copy(e){return super.copy(e),this.focus=e.focus,this.aspect=e.aspect,this}toJSON(){let e=super.toJSON();return e.focus=this.focus,e.aspect=this.aspect,e}};import{Object3D as ir}from"./three.js";var Ne=class extends ue{constructor(e,t,n=0,r=Math.PI/3,i=0,o=2){super(e,t),this.isSpotLight=!0,this.type="SpotLight",this.position.copy(ir.DEFAULT_UP),this.updateMatrix(),this.target=new ir,this.distance=n,this.angle=r,this.penumbra=i,this.decay=o,this.map=null,this.shadow=new Ke}get power(){return this.intensity*Math.PI}set power(e){this.intensity=e/Math.PI}dispose(){super.dispose(),this.shadow.dispose()}copy(e,t){return super.copy(e,t),this.distance=e.distance,this.angle=e.angle,this.penumbra=e.penumbra,this.decay=e.decay,this.target=e.target.clone(),this.map=e.map,this.shadow=e.shadow.clone(),this}toJSON(e){let t=super.toJSON(e);return t.object.distance=this.distance,t.object.angle=this.angle,t.object.decay=this.decay,t.object.penumbra=this.penumbra,t.object.target=this.target.uuid,this.map&&this.map.isTexture&&(t.object.map=this.map.toJSON(e).uuid),t.object.shadow=this.shadow.toJSON(),t}};import{PerspectiveCamera as di}from"./three.js";var qe=class extends he{constructor(){super(new di(90,1,.5,500)),this.isPointLightShadow=!0}};var Ie=class extends ue{constructor(e,t,n=0,r=2){super(e,t),this.isPointLight=!0,this.type="PointLight",this.distance=n,this.decay=r,this.shadow=new qe}get power(){return this.intensity*4*Math.PI}set power(e){this.intensity=e/(4*Math.PI)}dispose(){super.dispose(),this.shadow.dispose()}copy(e,t){return super.copy(e,t),this.distance=e.distance,this.decay=e.decay,this.shadow=e.shadow.clone(),this}toJSON(e){let t=super.toJSON(e);return t.object.distance=this.distance,t.object.decay=this.decay,t.object.shadow=this.shadow.toJSON(),t}};import{Loader as ui}from"./three.js";var It=new WeakMap,we=class extends ui{constructor(e){super(e),this.isImageBitmapLoader=!0,typeof createImageBitmap>"u"&&L("ImageBitmapLoader: createImageBitmap() not supported."),typeof fetch>"u"&&L("ImageBitmapLoader: fetch() not supported."),this.options={premultiplyAlpha:"none"},this._abortController=new AbortController}setOptions(e){return this.options=e,this}load(e,t,n,r){e===void 0&&(e=""),this.path!==void 0&&(e=this.path+e),e=this.manager.resolveURL(e);let i=this,o=O.get(`image-bitmap:${e}`);if(o!==void 0){if(i.manager.itemStart(e),o.then){o.then(l=>{It.has(o)===!0?(r&&r(It.get(o)),i.manager.itemError(e),i.manager.itemEnd(e)):(t&&t(l),i.manager.itemEnd(e))});return}setTimeout(function(){t&&t(o),i.manager.itemEnd(e)},0);return}let s={};s.credentials=this.withCredentials||this.crossOrigin!=="anonymous"?"include":"same-origin",s.headers=this.requestHeader,s.priority=this.priority,s.cache=this.cache,s.signal=typeof AbortSignal.any=="function"?AbortSignal.any([this._abortController.signal,this.manager.abortController.signal]):this._abortController.signal;let c=fetch(e,s).then(function(l){return l.blob()}).then(function(l){return createImageBitmap(l,Object.assign({},i.options,{colorSpaceConversion:"none"}))}).then(function(l){return O.add(`image-bitmap:${e}`,l),t&&t(l),i.manager.itemEnd(e),l}).catch(function(l){r&&r(l),It.set(c,l),O.remove(`image-bitmap:${e}`),i.manager.itemError(e),i.manager.itemEnd(e)});O.add(`image-bitmap:${e}`,c),i.manager.itemStart(e)}abort(){return this._abortController.abort(),this._abortController=new AbortController,this}};var Rt="\\[\\]\\.:\\/",hi=new RegExp("["+Rt+"]","g"),bt="[^"+Rt+"]",pi="[^"+Rt.replace("\\.","")+"]",mi=/((?:WC+[\/:])*)/.source.replace("WC",bt),gi=/(WCOD+)?/.source.replace("WCOD",pi),vi=/(?:\.(WC+)(?:\[(.+)\])?)?/.source.replace("WC",bt),_i=/\.(WC+)(?:\[(.+)\])?/.source.replace("WC",bt),Si=new RegExp("^"+mi+gi+vi+_i+"$"),xi=["material","materials","bones","map"],wt=class{constructor(e,t,n){let r=n||E.parseTrackName(t);this._targetGroup=e,this._bindings=e.subscribe_(t,r)}getValue(e,t){this.bind();let n=this._targetGroup.nCachedObjects_,r=this._bindings[n];r!==void 0&&r.getValue(e,t)}setValue(e,t){let n=this._bindings;for(let r=this._targetGroup.nCachedObjects_,i=n.length;r!==i;++r)n[r].setValue(e,t)}bind(){let e=this._bindings;for(let t=this._targetGroup.nCachedObjects_,n=e.length;t!==n;++t)e[t].bind()}unbind(){let e=this._bindings;for(let t=this._targetGroup.nCachedObjects_,n=e.length;t!==n;++t)e[t].unbind()}},E=class a{constructor(e,t,n){this.path=t,this.parsedPath=n||a.parseTrackName(t),this.node=a.findNode(e,this.parsedPath.nodeName),this.rootNode=e,this.getValue=this._getValue_unbound,this.setValue=this._setValue_unbound}static create(e,t,n){return e&&e.isAnimationObjectGroup?new a.Composite(e,t,n):new a(e,t,n)}static sanitizeNodeName(e){return e.replace(/\s/g,"_").replace(hi,"")}static parseTrackName(e){let t=Si.exec(e);if(t===null)throw new Error("THREE.PropertyBinding: Cannot parse trackName: "+e);let n={nodeName:t[2],objectName:t[3],objectIndex:t[4],propertyName:t[5],propertyIndex:t[6]},r=n.nodeName&&n.nodeName.lastIndexOf(".");if(r!==void 0&&r!==-1){let i=n.nodeName.substring(r+1);xi.indexOf(i)!==-1&&(n.nodeName=n.nodeName.substring(0,r),n.objectName=i)}if(n.propertyName===null||n.propertyName.length===0)throw new Error("THREE.PropertyBinding: can not parse propertyName from trackName: "+e);return n}static findNode(e,t){if(t===void 0||t===""||t==="."||t===-1||t===e.name||t===e.uuid)return e;if(e.skeleton){let n=e.skeleton.getBoneByName(t);if(n!==void 0)return n}if(e.children){let n=function(i){for(let o=0;o<i.length;o++){let s=i[o];if(s.name===t||s.uuid===t)return s;let c=n(s.children);if(c)return c}return null},r=n(e.children);if(r)return r}return null}_getValue_unavailable(){}_setValue_unavailable(){}_getValue_direct(e,t){e[t]=this.targetObject[this.propertyName]}_getValue_array(e,t){let n=this.resolvedProperty;for(let r=0,i=n.length;r!==i;++r)e[t++]=n[r]}_getValue_arrayElement(e,t){e[t]=this.resolvedProperty[this.propertyIndex]}_getValue_toArray(e,t){this.resolvedProperty.toArray(e,t)}_setValue_direct(e,t){this.targetObject[this.propertyName]=e[t]}_setValue_direct_setNeedsUpdate(e,t){this.targetObject[this.propertyName]=e[t],this.targetObject.needsUpdate=!0}_setValue_direct_setMatrixWorldNeedsUpdate(e,t){this.targetObject[this.propertyName]=e[t],this.targetObject.matrixWorldNeedsUpdate=!0}_setValue_array(e,t){let n=this.resolvedProperty;for(let r=0,i=n.length;r!==i;++r)n[r]=e[t++]}_setValue_array_setNeedsUpdate(e,t){let n=this.resolvedProperty;for(let r=0,i=n.length;r!==i;++r)n[r]=e[t++];this.targetObject.needsUpdate=!0}_setValue_array_setMatrixWorldNeedsUpdate(e,t){let n=this.resolvedProperty;for(let r=0,i=n.length;r!==i;++r)n[r]=e[t++];this.targetObject.matrixWorldNeedsUpdate=!0}_setValue_arrayElement(e,t){this.resolvedProperty[this.propertyIndex]=e[t]}_setValue_arrayElement_setNeedsUpdate(e,t){this.resolvedProperty[this.propertyIndex]=e[t],this.targetObject.needsUpdate=!0}_setValue_arrayElement_setMatrixWorldNeedsUpdate(e,t){this.resolvedProperty[this.propertyIndex]=e[t],this.targetObject.matrixWorldNeedsUpdate=!0}_setValue_fromArray(e,t){this.resolvedProperty.fromArray(e,t)}_setValue_fromArray_setNeedsUpdate(e,t){this.resolvedProperty.fromArray(e,t),this.targetObject.needsUpdate=!0}_setValue_fromArray_setMatrixWorldNeedsUpdate(e,t){this.resolvedProperty.fromArray(e,t),this.targetObject.matrixWorldNeedsUpdate=!0}_getValue_unbound(e,t){this.bind(),this.getValue(e,t)}_setValue_unbound(e,t){this.bind(),this.setValue(e,t)}bind(){let e=this.node,t=this.parsedPath,n=t.objectName,r=t.propertyName,i=t.propertyIndex;if(e||(e=a.findNode(this.rootNode,t.nodeName),this.node=e),this.getValue=this._getValue_unavailable,this.setValue=this._setValue_unavailable,!e){L("PropertyBinding: No target node found for track: "+this.path+".");return}if(n){let l=t.objectIndex;switch(n){case"materials":if(!e.material){R("PropertyBinding: Can not bind to material as node does not have a material.",this);return}if(!e.material.materials){R("PropertyBinding: Can not bind to material.materials as node.material does not have a materials array.",this);return}e=e.material.materials;break;case"bones":if(!e.skeleton){R("PropertyBinding: Can not bind to bones as node does not have a skeleton.",this);return}e=e.skeleton.bones;for(let f=0;f<e.length;f++)if(e[f].name===l){l=f;break}break;case"map":if("map"in e){e=e.map;break}if(!e.material){R("PropertyBinding: Can not bind to material as node does not have a material.",this);return}if(!e.material.map){R("PropertyBinding: Can not bind to material.map as node.material does not have a map.",this);return}e=e.material.map;break;default:if(e[n]===void 0){R("PropertyBinding: Can not bind to objectName of node undefined.",this);return}e=e[n]}if(l!==void 0){if(e[l]===void 0){R("PropertyBinding: Trying to bind to objectIndex of objectName, but is undefined.",this,e);return}e=e[l]}}let o=e[r];if(o===void 0){let l=t.nodeName;R("PropertyBinding: Trying to update property for track: "+l+"."+r+" but it wasn't found.",e);return}let s=this.Versioning.None;this.targetObject=e,e.isMaterial===!0?s=this.Versioning.NeedsUpdate:e.isObject3D===!0&&(s=this.Versioning.MatrixWorldNeedsUpdate);let c=this.BindingType.Direct;if(i!==void 0){if(r==="morphTargetInfluences"){if(!e.geometry){R("PropertyBinding: Can not bind to morphTargetInfluences because node does not have a geometry.",this);return}if(!e.geometry.morphAttributes){R("PropertyBinding: Can not bind to morphTargetInfluences because node does not have a geometry.morphAttributes.",this);return}e.morphTargetDictionary[i]!==void 0&&(i=e.morphTargetDictionary[i])}c=this.BindingType.ArrayElement,this.resolvedProperty=o,this.propertyIndex=i}else o.fromArray!==void 0&&o.toArray!==void 0?(c=this.BindingType.HasFromToArray,this.resolvedProperty=o):Array.isArray(o)?(c=this.BindingType.EntireArray,this.resolvedProperty=o):this.propertyName=r;this.getValue=this.GetterByBindingType[c],this.setValue=this.SetterByBindingTypeAndVersioning[c][s]}unbind(){this.node=null,this.getValue=this._getValue_unbound,this.setValue=this._setValue_unbound}};E.Composite=wt;E.prototype.BindingType={Direct:0,EntireArray:1,ArrayElement:2,HasFromToArray:3};E.prototype.Versioning={None:0,NeedsUpdate:1,MatrixWorldNeedsUpdate:2};E.prototype.GetterByBindingType=[E.prototype._getValue_direct,E.prototype._getValue_array,E.prototype._getValue_arrayElement,E.prototype._getValue_toArray];E.prototype.SetterByBindingTypeAndVersioning=[[E.prototype._setValue_direct,E.prototype._setValue_direct_setNeedsUpdate,E.prototype._setValue_direct_setMatrixWorldNeedsUpdate],[E.prototype._setValue_array,E.prototype._setValue_array_setNeedsUpdate,E.prototype._setValue_array_setMatrixWorldNeedsUpdate],[E.prototype._setValue_arrayElement,E.prototype._setValue_arrayElement_setNeedsUpdate,E.prototype._setValue_arrayElement_setMatrixWorldNeedsUpdate],[E.prototype._setValue_fromArray,E.prototype._setValue_fromArray_setNeedsUpdate,E.prototype._setValue_fromArray_setMatrixWorldNeedsUpdate]];Object.assign(vr,{alphahash_fragment:`
#ifdef USE_ALPHAHASH
if ( diffuseColor.a<getAlphaHashThreshold( vPosition ) ) discard;
#endif
`,alphahash_pars_fragment:`
#ifdef USE_ALPHAHASH
/**
*See:https:
*/
const float ALPHA_HASH_SCALE=.05;
float hash2D( vec2 value ){
return fract( 1.0e4*sin( 17.*value.x+.1*value.y )*( .1+abs( sin( 13.*value.y+value.x ) ) ) );
}
float hash3D( vec3 value ){
return hash2D( vec2( hash2D( value.xy ),value.z ) );
}
float getAlphaHashThreshold( vec3 position ){
float maxDeriv=max(
length( dFdx( position.xyz ) ),
length( dFdy( position.xyz ) )
);
float pixScale=1./( ALPHA_HASH_SCALE*maxDeriv );
vec2 pixScales=vec2(
exp2( floor( log2( pixScale ) ) ),
exp2( ceil( log2( pixScale ) ) )
);
vec2 alpha=vec2(
hash3D( floor( pixScales.x*position.xyz ) ),
hash3D( floor( pixScales.y*position.xyz ) )
);
float lerpFactor=fract( log2( pixScale ) );
float x=( 1. - lerpFactor )*alpha.x+lerpFactor*alpha.y;
float a=min( lerpFactor,1. - lerpFactor );
vec3 cases=vec3(
x*x/( 2.*a*( 1. - a ) ),
( x - .5*a )/( 1. - a ),
1. - ( ( 1. - x )*( 1. - x )/( 2.*a*( 1. - a ) ) )
);
float threshold=( x<( 1. - a ) )
?( ( x<a )?cases.x:cases.y )
:cases.z;
return clamp( threshold,1.0e-6,1. );
}
#endif
`,alphamap_fragment:`
#ifdef USE_ALPHAMAP
diffuseColor.a*=texture2D( alphaMap,vAlphaMapUv ).g;
#endif
`,alphamap_pars_fragment:`
#ifdef USE_ALPHAMAP
uniform sampler2D alphaMap;
#endif
`,aomap_fragment:`
#ifdef USE_AOMAP
float ambientOcclusion=( texture2D( aoMap,vAoMapUv ).r - 1. )*aoMapIntensity+1.;
reflectedLight.indirectDiffuse*=ambientOcclusion;
#if defined( USE_CLEARCOAT ) 
clearcoatSpecularIndirect*=ambientOcclusion;
#endif
#if defined( USE_SHEEN ) 
sheenSpecularIndirect*=ambientOcclusion;
#endif
#if defined( USE_ENVMAP ) && defined( STANDARD )
float dotNV=saturate( dot( geometryNormal,geometryViewDir ) );
reflectedLight.indirectSpecular*=computeSpecularOcclusion( dotNV,ambientOcclusion,material.roughness );
#endif
#endif
`,aomap_pars_fragment:`
#ifdef USE_AOMAP
uniform sampler2D aoMap;
uniform float aoMapIntensity;
#endif
`,batching_pars_vertex:`
#ifdef USE_BATCHING
#if ! defined( GL_ANGLE_multi_draw )
#define gl_DrawID _gl_DrawID
uniform int _gl_DrawID;
#endif
uniform highp sampler2D batchingTexture;
uniform highp usampler2D batchingIdTexture;
mat4 getBatchingMatrix( const in float i ){
int size=textureSize( batchingTexture,0 ).x;
int j=int( i )*4;
int x=j % size;
int y=j/size;
vec4 v1=texelFetch( batchingTexture,ivec2( x,y ),0 );
vec4 v2=texelFetch( batchingTexture,ivec2( x+1,y ),0 );
vec4 v3=texelFetch( batchingTexture,ivec2( x+2,y ),0 );
vec4 v4=texelFetch( batchingTexture,ivec2( x+3,y ),0 );
return mat4( v1,v2,v3,v4 );
}
float getIndirectIndex( const in int i ){
int size=textureSize( batchingIdTexture,0 ).x;
int x=i % size;
int y=i/size;
return float( texelFetch( batchingIdTexture,ivec2( x,y ),0 ).r );
}
#endif
#ifdef USE_BATCHING_COLOR
uniform sampler2D batchingColorTexture;
vec4 getBatchingColor( const in float i ){
int size=textureSize( batchingColorTexture,0 ).x;
int j=int( i );
int x=j % size;
int y=j/size;
return texelFetch( batchingColorTexture,ivec2( x,y ),0 );
}
#endif
`,batching_vertex:`
#ifdef USE_BATCHING
mat4 batchingMatrix=getBatchingMatrix( getIndirectIndex( gl_DrawID ) );
#endif
`,begin_vertex:`
vec3 transformed=vec3( position );
#ifdef USE_ALPHAHASH
vPosition=vec3( position );
#endif
`,bumpmap_pars_fragment:`
#ifdef USE_BUMPMAP
uniform sampler2D bumpMap;
uniform float bumpScale;
vec2 dHdxy_fwd(){
vec2 dSTdx=dFdx( vBumpMapUv );
vec2 dSTdy=dFdy( vBumpMapUv );
float Hll=bumpScale*texture2D( bumpMap,vBumpMapUv ).x;
float dBx=bumpScale*texture2D( bumpMap,vBumpMapUv+dSTdx ).x - Hll;
float dBy=bumpScale*texture2D( bumpMap,vBumpMapUv+dSTdy ).x - Hll;
return vec2( dBx,dBy );
}
vec3 perturbNormalArb( vec3 surf_pos,vec3 surf_norm,vec2 dHdxy,float faceDirection ){
vec3 vSigmaX=normalize( dFdx( surf_pos.xyz ) );
vec3 vSigmaY=normalize( dFdy( surf_pos.xyz ) );
vec3 vN=surf_norm;
vec3 R1=cross( vSigmaY,vN );
vec3 R2=cross( vN,vSigmaX );
float fDet=dot( vSigmaX,R1 )*faceDirection;
vec3 vGrad=sign( fDet )*( dHdxy.x*R1+dHdxy.y*R2 );
return normalize( abs( fDet )*surf_norm - vGrad );
}
#endif
`,clearcoat_normal_fragment_begin:`
#ifdef USE_CLEARCOAT
vec3 clearcoatNormal=nonPerturbedNormal;
#endif
`,clearcoat_normal_fragment_maps:`
#ifdef USE_CLEARCOAT_NORMALMAP
vec3 clearcoatMapN=texture2D( clearcoatNormalMap,vClearcoatNormalMapUv ).xyz*2. - 1.;
clearcoatMapN.xy*=clearcoatNormalScale;
clearcoatNormal=normalize( tbn2*clearcoatMapN );
#endif
`,clearcoat_pars_fragment:`
#ifdef USE_CLEARCOATMAP
uniform sampler2D clearcoatMap;
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
uniform sampler2D clearcoatNormalMap;
uniform vec2 clearcoatNormalScale;
#endif
#ifdef USE_CLEARCOAT_ROUGHNESSMAP
uniform sampler2D clearcoatRoughnessMap;
#endif
`,clipping_planes_fragment:`
#if NUM_CLIPPING_PLANES > 0
vec4 plane;
#ifdef ALPHA_TO_COVERAGE
float distanceToPlane,distanceGradient;
float clipOpacity=1.;
#pragma unroll_loop_start
for ( int i=0;i<UNION_CLIPPING_PLANES;i++){
plane=clippingPlanes[ i ];
distanceToPlane=- dot( vClipPosition,plane.xyz )+plane.w;
distanceGradient=fwidth( distanceToPlane )/2.;
clipOpacity*=smoothstep( - distanceGradient,distanceGradient,distanceToPlane );
if ( clipOpacity==.0 ) discard;
}
#pragma unroll_loop_end
#if UNION_CLIPPING_PLANES < NUM_CLIPPING_PLANES
float unionClipOpacity=1.;
#pragma unroll_loop_start
for ( int i=UNION_CLIPPING_PLANES;i<NUM_CLIPPING_PLANES;i++){
plane=clippingPlanes[ i ];
distanceToPlane=- dot( vClipPosition,plane.xyz )+plane.w;
distanceGradient=fwidth( distanceToPlane )/2.;
unionClipOpacity*=1. - smoothstep( - distanceGradient,distanceGradient,distanceToPlane );
}
#pragma unroll_loop_end
clipOpacity*=1. - unionClipOpacity;
#endif
diffuseColor.a*=clipOpacity;
if ( diffuseColor.a==.0 ) discard;
#else
#pragma unroll_loop_start
for ( int i=0;i<UNION_CLIPPING_PLANES;i++){
plane=clippingPlanes[ i ];
if ( dot( vClipPosition,plane.xyz )>plane.w ) discard;
}
#pragma unroll_loop_end
#if UNION_CLIPPING_PLANES < NUM_CLIPPING_PLANES
bool clipped=true;
#pragma unroll_loop_start
for ( int i=UNION_CLIPPING_PLANES;i<NUM_CLIPPING_PLANES;i++){
plane=clippingPlanes[ i ];
clipped=( dot( vClipPosition,plane.xyz )>plane.w ) && clipped;
}
#pragma unroll_loop_end
if ( clipped ) discard;
#endif
#endif
#endif
`,clipping_planes_pars_fragment:`
#if NUM_CLIPPING_PLANES > 0
varying vec3 vClipPosition;
uniform vec4 clippingPlanes[ NUM_CLIPPING_PLANES ];
#endif
`,clipping_planes_pars_vertex:`
#if NUM_CLIPPING_PLANES > 0
varying vec3 vClipPosition;
#endif
`,clipping_planes_vertex:`
#if NUM_CLIPPING_PLANES > 0
vClipPosition=- mvPosition.xyz;
#endif
`,color_vertex:`
#if defined( USE_COLOR ) || defined( USE_COLOR_ALPHA ) || defined( USE_INSTANCING_COLOR ) || defined( USE_BATCHING_COLOR )
vColor=vec4( 1. );
#endif
#ifdef USE_COLOR_ALPHA
vColor*=color;
#elif defined( USE_COLOR )
vColor.rgb*=color;
#endif
#ifdef USE_INSTANCING_COLOR
vColor.rgb*=instanceColor.rgb;
#endif
#ifdef USE_BATCHING_COLOR
vColor*=getBatchingColor( getIndirectIndex( gl_DrawID ) );
#endif
`,colorspace_pars_fragment:`
vec4 LinearTransferOETF( in vec4 value ){
return value;
}
vec4 sRGBTransferEOTF( in vec4 value ){
return vec4( mix( pow( value.rgb*.9478672986+vec3( .0521327014 ),vec3( 2.4 ) ),value.rgb*.0773993808,vec3( lessThanEqual( value.rgb,vec3( .04045 ) ) ) ),value.a );
}
vec4 sRGBTransferOETF( in vec4 value ){
return vec4( mix( pow( value.rgb,vec3( .41666 ) )*1.055 - vec3( .055 ),value.rgb*12.92,vec3( lessThanEqual( value.rgb,vec3( .0031308 ) ) ) ),value.a );
}
`,common:`
#define PI 3.141592653589793
#define PI2 6.283185307179586
#define PI_HALF 1.5707963267948966
#define RECIPROCAL_PI 0.3183098861837907
#define RECIPROCAL_PI2 0.15915494309189535
#define EPSILON 1e-6
#ifndef saturate
#define saturate( a ) clamp( a, 0.0, 1.0 )
#endif
#define whiteComplement( a ) ( 1.0 - saturate( a ) )
float pow2( const in float x ){return x*x;}
vec3 pow2( const in vec3 x ){return x*x;}
float pow3( const in float x ){return x*x*x;}
float pow4( const in float x ){float x2=x*x;return x2*x2;}
float max3( const in vec3 v ){return max( max( v.x,v.y ),v.z );}
float average( const in vec3 v ){return dot( v,vec3( .3333333 ) );}
highp float rand( const in vec2 uv ){
const highp float a=12.9898,b=78.233,c=43758.5453;
highp float dt=dot( uv.xy,vec2( a,b ) ),sn=mod( dt,PI );
return fract( sin( sn )*c );
}
#ifdef HIGH_PRECISION
float precisionSafeLength( vec3 v ){return length( v );}
#else
float precisionSafeLength( vec3 v ){
float maxComponent=max3( abs( v ) );
return length( v/maxComponent )*maxComponent;
}
#endif
struct IncidentLight{
vec3 color;
vec3 direction;
bool visible;
};
struct ReflectedLight{
vec3 directDiffuse;
vec3 directSpecular;
vec3 indirectDiffuse;
vec3 indirectSpecular;
};
#ifdef USE_ALPHAHASH
varying vec3 vPosition;
#endif
vec3 transformDirection( in vec3 dir,in mat4 matrix ){
return normalize( ( matrix*vec4( dir,.0 ) ).xyz );
}
#define inverseTransformDirection transformDirectionByInverseViewMatrix
vec3 transformNormalByInverseViewMatrix( in vec3 normal,in mat4 viewMatrix ){
return normalize( ( vec4( normal,.0 )*viewMatrix ).xyz );
}
vec3 transformDirectionByInverseViewMatrix( in vec3 dir,in mat4 viewMatrix ){
return normalize( ( vec4( dir,.0 )*viewMatrix ).xyz );
}
bool isPerspectiveMatrix( mat4 m ){
return m[ 2 ][ 3 ]==- 1.;
}
vec2 equirectUv( in vec3 dir ){
float u=atan( dir.z,dir.x )*RECIPROCAL_PI2+.5;
float v=asin( clamp( dir.y,- 1.,1. ) )*RECIPROCAL_PI+.5;
return vec2( u,v );
}
vec3 BRDF_Lambert( const in vec3 diffuseColor ){
return RECIPROCAL_PI*diffuseColor;
}
vec3 F_Schlick( const in vec3 f0,const in float f90,const in float dotVH ){
float fresnel=exp2( ( - 5.55473*dotVH - 6.98316 )*dotVH );
return f0*( 1. - fresnel )+( f90*fresnel );
}
float F_Schlick( const in float f0,const in float f90,const in float dotVH ){
float fresnel=exp2( ( - 5.55473*dotVH - 6.98316 )*dotVH );
return f0*( 1. - fresnel )+( f90*fresnel );
}
`,defaultnormal_vertex:`
vec3 transformedNormal=objectNormal;
#ifdef USE_TANGENT
vec3 transformedTangent=objectTangent;
#endif
#ifdef USE_BATCHING
mat3 bm=mat3( batchingMatrix );
transformedNormal/=vec3( dot( bm[ 0 ],bm[ 0 ] ),dot( bm[ 1 ],bm[ 1 ] ),dot( bm[ 2 ],bm[ 2 ] ) );
transformedNormal=bm*transformedNormal;
#ifdef USE_TANGENT
transformedTangent=bm*transformedTangent;
#endif
#endif
#ifdef USE_INSTANCING
mat3 im=mat3( instanceMatrix );
transformedNormal/=vec3( dot( im[ 0 ],im[ 0 ] ),dot( im[ 1 ],im[ 1 ] ),dot( im[ 2 ],im[ 2 ] ) );
transformedNormal=im*transformedNormal;
#ifdef USE_TANGENT
transformedTangent=im*transformedTangent;
#endif
#endif
transformedNormal=normalMatrix*transformedNormal;
#ifdef FLIP_SIDED
transformedNormal=- transformedNormal;
#endif
#ifdef USE_TANGENT
transformedTangent=( modelViewMatrix*vec4( transformedTangent,.0 ) ).xyz;
#endif
`,displacementmap_pars_vertex:`
#ifdef USE_DISPLACEMENTMAP
uniform sampler2D displacementMap;
uniform float displacementScale;
uniform float displacementBias;
#endif
`,displacementmap_vertex:`
#ifdef USE_DISPLACEMENTMAP
transformed+=normalize( objectNormal )*( texture2D( displacementMap,vDisplacementMapUv ).x*displacementScale+displacementBias );
#endif
`,dithering_fragment:`
#ifdef DITHERING
gl_FragColor.rgb=dithering( gl_FragColor.rgb );
#endif
`,dithering_pars_fragment:`
#ifdef DITHERING
vec3 dithering( vec3 color ){
float grid_position=rand( gl_FragCoord.xy );
vec3 dither_shift_RGB=vec3( .25/255.,-.25/255.,.25/255. );
dither_shift_RGB=mix( 2.*dither_shift_RGB,-2.*dither_shift_RGB,grid_position );
return color+dither_shift_RGB;
}
#endif
`,emissivemap_fragment:`
#ifdef USE_EMISSIVEMAP
vec4 emissiveColor=texture2D( emissiveMap,vEmissiveMapUv );
#ifdef DECODE_VIDEO_TEXTURE_EMISSIVE
emissiveColor=sRGBTransferEOTF( emissiveColor );
#endif
totalEmissiveRadiance*=emissiveColor.rgb;
#endif
`,emissivemap_pars_fragment:`
#ifdef USE_EMISSIVEMAP
uniform sampler2D emissiveMap;
#endif
`,envmap_common_pars_fragment:`
#ifdef USE_ENVMAP
uniform float envMapIntensity;
uniform mat3 envMapRotation;
uniform samplerCube envMap;
#ifdef ENVMAP_TYPE_PMREM
float roughnessToMip( const in float roughness ){
float r=clamp( roughness,.0,1. );
return ENVMAP_MAX_LOD*r*( 2. - r );
}
#endif
#endif
`,envmap_fragment:`
#ifdef USE_ENVMAP
#ifdef ENV_WORLDPOS
vec3 cameraToFrag;
if ( isOrthographic ){
cameraToFrag=normalize( vec3( - viewMatrix[ 0 ][ 2 ],- viewMatrix[ 1 ][ 2 ],- viewMatrix[ 2 ][ 2 ] ) );
}else{
cameraToFrag=normalize( vWorldPosition - cameraPosition );
}
vec3 worldNormal=transformNormalByInverseViewMatrix( normal,viewMatrix );
#ifdef ENVMAP_MODE_REFLECTION
vec3 reflectVec=reflect( cameraToFrag,worldNormal );
#else
vec3 reflectVec=refract( cameraToFrag,worldNormal,refractionRatio );
#endif
#else
vec3 reflectVec=vReflect;
#endif
#ifdef ENVMAP_TYPE_CUBE
vec4 envColor=textureCube( envMap,envMapRotation*reflectVec );
#ifdef ENVMAP_BLENDING_MULTIPLY
outgoingLight=mix( outgoingLight,outgoingLight*envColor.xyz,specularStrength*reflectivity );
#elif defined( ENVMAP_BLENDING_MIX )
outgoingLight=mix( outgoingLight,envColor.xyz,specularStrength*reflectivity );
#elif defined( ENVMAP_BLENDING_ADD )
outgoingLight+=envColor.xyz*specularStrength*reflectivity;
#endif
#endif
#endif
`,envmap_pars_fragment:`
#ifdef USE_ENVMAP
uniform float reflectivity;
#if defined( USE_BUMPMAP ) || defined( USE_NORMALMAP ) || defined( PHONG ) || defined( LAMBERT )
#define ENV_WORLDPOS
#endif
#ifdef ENV_WORLDPOS
varying vec3 vWorldPosition;
uniform float refractionRatio;
#else
varying vec3 vReflect;
#endif
#endif
`,envmap_pars_vertex:`
#ifdef USE_ENVMAP
#if defined( USE_BUMPMAP ) || defined( USE_NORMALMAP ) || defined( PHONG ) || defined( LAMBERT )
#define ENV_WORLDPOS
#endif
#ifdef ENV_WORLDPOS
varying vec3 vWorldPosition;
#else
varying vec3 vReflect;
uniform float refractionRatio;
#endif
#endif
`,envmap_physical_pars_fragment:`
#ifdef USE_ENVMAP
vec3 getIBLIrradiance( const in vec3 normal ){
#ifdef ENVMAP_TYPE_PMREM
vec3 worldNormal=transformNormalByInverseViewMatrix( normal,viewMatrix );
vec4 envMapColor=textureLod( envMap,envMapRotation*worldNormal,ENVMAP_MAX_LOD );
return PI*envMapColor.rgb*envMapIntensity;
#else
return vec3( .0 );
#endif
}
vec3 getIBLRadiance( const in vec3 viewDir,const in vec3 normal,const in float roughness ){
#ifdef ENVMAP_TYPE_PMREM
vec3 reflectVec=reflect( - viewDir,normal );
reflectVec=normalize( mix( reflectVec,normal,pow4( roughness ) ) );
reflectVec=transformDirectionByInverseViewMatrix( reflectVec,viewMatrix );
vec4 envMapColor=textureLod( envMap,envMapRotation*reflectVec,roughnessToMip( roughness ) );
return envMapColor.rgb*envMapIntensity;
#else
return vec3( .0 );
#endif
}
#ifdef USE_RETROREFLECTION
vec3 getIBLRetroRadiance( const in vec3 viewDir,const in vec3 normal,const in float roughness ){
#ifdef ENVMAP_TYPE_PMREM
vec3 retroVec=normalize( mix( viewDir,normal,pow4( roughness ) ) );
retroVec=transformDirectionByInverseViewMatrix( retroVec,viewMatrix );
vec4 envMapColor=textureLod( envMap,envMapRotation*retroVec,roughnessToMip( roughness ) );
return envMapColor.rgb*envMapIntensity;
#else
return vec3( .0 );
#endif
}
#endif
#ifdef USE_ANISOTROPY
vec3 getIBLAnisotropyRadiance( const in vec3 viewDir,const in vec3 normal,const in float roughness,const in vec3 bitangent,const in float anisotropy ){
#ifdef ENVMAP_TYPE_PMREM
vec3 bentNormal=cross( bitangent,viewDir );
bentNormal=normalize( cross( bentNormal,bitangent ) );
bentNormal=normalize( mix( bentNormal,normal,pow2( pow2( 1. - anisotropy*( 1. - roughness ) ) ) ) );
return getIBLRadiance( viewDir,bentNormal,roughness );
#else
return vec3( .0 );
#endif
}
#ifdef USE_RETROREFLECTION
vec3 getIBLAnisotropyRetroRadiance( const in vec3 viewDir,const in vec3 normal,const in float roughness,const in vec3 bitangent,const in float anisotropy ){
#ifdef ENVMAP_TYPE_PMREM
vec3 bentNormal=cross( bitangent,viewDir );
bentNormal=normalize( cross( bentNormal,bitangent ) );
bentNormal=normalize( mix( bentNormal,normal,pow2( pow2( 1. - anisotropy*( 1. - roughness ) ) ) ) );
return getIBLRetroRadiance( viewDir,bentNormal,roughness );
#else
return vec3( .0 );
#endif
}
#endif
#endif
#endif
`,envmap_vertex:`
#ifdef USE_ENVMAP
#ifdef ENV_WORLDPOS
vWorldPosition=worldPosition.xyz;
#else
vec3 cameraToVertex;
if ( isOrthographic ){
cameraToVertex=normalize( vec3( - viewMatrix[ 0 ][ 2 ],- viewMatrix[ 1 ][ 2 ],- viewMatrix[ 2 ][ 2 ] ) );
}else{
cameraToVertex=normalize( worldPosition.xyz - cameraPosition );
}
vec3 worldNormal=transformNormalByInverseViewMatrix( transformedNormal,viewMatrix );
#ifdef ENVMAP_MODE_REFLECTION
vReflect=reflect( cameraToVertex,worldNormal );
#else
vReflect=refract( cameraToVertex,worldNormal,refractionRatio );
#endif
#endif
#endif
`,gradientmap_pars_fragment:`
#ifdef USE_GRADIENTMAP
uniform sampler2D gradientMap;
#endif
vec3 getGradientIrradiance( vec3 normal,vec3 lightDirection ){
float dotNL=dot( normal,lightDirection );
vec2 coord=vec2( dotNL*.5+.5,.0 );
#ifdef USE_GRADIENTMAP
return vec3( texture2D( gradientMap,coord ).r );
#else
vec2 fw=fwidth( coord )*.5;
return mix( vec3( .7 ),vec3( 1. ),smoothstep( .7 - fw.x,.7+fw.x,coord.x ) );
#endif
}
`,iridescence_fragment:`
#ifdef USE_IRIDESCENCE
const mat3 XYZ_TO_REC709=mat3(
3.2404542,-.9692660, .0556434,
-1.5371385, 1.8760108,-.2040259,
-.4985314, .0415560, 1.0572252
);
vec3 Fresnel0ToIor( vec3 fresnel0 ){
vec3 sqrtF0=sqrt( fresnel0 );
return ( vec3( 1. )+sqrtF0 )/( vec3( 1. ) - sqrtF0 );
}
vec3 IorToFresnel0( vec3 transmittedIor,float incidentIor ){
return pow2( ( transmittedIor - vec3( incidentIor ) )/( transmittedIor+vec3( incidentIor ) ) );
}
float IorToFresnel0( float transmittedIor,float incidentIor ){
return pow2( ( transmittedIor - incidentIor )/( transmittedIor+incidentIor ));
}
vec3 evalSensitivity( float OPD,vec3 shift ){
float phase=2.*PI*OPD*1.0e-9;
vec3 val=vec3( 5.4856e-13,4.4201e-13,5.2481e-13 );
vec3 pos=vec3( 1.6810e+06,1.7953e+06,2.2084e+06 );
vec3 var=vec3( 4.3278e+09,9.3046e+09,6.6121e+09 );
vec3 xyz=val*sqrt( 2.*PI*var )*cos( pos*phase+shift )*exp( - pow2( phase )*var );
xyz.x+=9.7470e-14*sqrt( 2.*PI*4.5282e+09 )*cos( 2.2399e+06*phase+shift[ 0 ] )*exp( - 4.5282e+09*pow2( phase ) );
xyz/=1.0685e-7;
vec3 rgb=XYZ_TO_REC709*xyz;
return rgb;
}
vec3 evalIridescence( float outsideIOR,float eta2,float cosTheta1,float thinFilmThickness,vec3 baseF0 ){
vec3 I;
float iridescenceIOR=mix( outsideIOR,eta2,smoothstep( .0,.03,thinFilmThickness ) );
float sinTheta2Sq=pow2( outsideIOR/iridescenceIOR )*( 1. - pow2( cosTheta1 ) );
float cosTheta2Sq=1. - sinTheta2Sq;
if ( cosTheta2Sq<.0 ){
return vec3( 1. );
}
float cosTheta2=sqrt( cosTheta2Sq );
float R0=IorToFresnel0( iridescenceIOR,outsideIOR );
float R12=F_Schlick( R0,1.,cosTheta1 );
float T121=1. - R12;
float phi12=.0;
if ( iridescenceIOR<outsideIOR ) phi12=PI;
float phi21=PI - phi12;
vec3 baseIOR=Fresnel0ToIor( clamp( baseF0,.0,.9999 ) );
vec3 R1=IorToFresnel0( baseIOR,iridescenceIOR );
vec3 R23=F_Schlick( R1,1.,cosTheta2 );
vec3 phi23=vec3( .0 );
if ( baseIOR[ 0 ]<iridescenceIOR ) phi23[ 0 ]=PI;
if ( baseIOR[ 1 ]<iridescenceIOR ) phi23[ 1 ]=PI;
if ( baseIOR[ 2 ]<iridescenceIOR ) phi23[ 2 ]=PI;
float OPD=2.*iridescenceIOR*thinFilmThickness*cosTheta2;
vec3 phi=vec3( phi21 )+phi23;
vec3 R123=clamp( R12*R23,1e-5,.9999 );
vec3 r123=sqrt( R123 );
vec3 Rs=pow2( T121 )*R23/( vec3( 1. ) - R123 );
vec3 C0=R12+Rs;
I=C0;
vec3 Cm=Rs - T121;
for ( int m=1;m<=2;++m ){
Cm*=r123;
vec3 Sm=2.*evalSensitivity( float( m )*OPD,float( m )*phi );
I+=Cm*Sm;
}
return max( I,vec3( .0 ) );
}
#endif
`,iridescence_pars_fragment:`
#ifdef USE_IRIDESCENCEMAP
uniform sampler2D iridescenceMap;
#endif
#ifdef USE_IRIDESCENCE_THICKNESSMAP
uniform sampler2D iridescenceThicknessMap;
#endif
`,lightmap_pars_fragment:`
#ifdef USE_LIGHTMAP
uniform sampler2D lightMap;
uniform float lightMapIntensity;
#endif
`,lightprobes_pars_fragment:`
#if NUM_LIGHT_PROBE_GRIDS > 0
uniform highp sampler3D probesSH[ NUM_LIGHT_PROBE_GRIDS ];
uniform vec3 probesMin[ NUM_LIGHT_PROBE_GRIDS ];
uniform vec3 probesMax[ NUM_LIGHT_PROBE_GRIDS ];
uniform vec3 probesResolution[ NUM_LIGHT_PROBE_GRIDS ];
bool isInsideLightProbeGrid( vec3 worldPos,vec3 worldNormal,vec3 probesMin,vec3 probesMax,vec3 probesResolution ){
vec3 spacing=( probesMax - probesMin )/probesResolution;
vec3 samplePos=worldPos+worldNormal*spacing*.5;
vec3 margin=spacing*.01;
return all( greaterThanEqual( samplePos,probesMin - margin ) ) && all( lessThanEqual( samplePos,probesMax+margin ) );
}
vec3 getLightProbeGridIrradiance( highp sampler3D probesSH,vec3 probesMin,vec3 probesMax,vec3 probesResolution,vec3 worldPos,vec3 worldNormal ){
vec3 res=probesResolution;
vec3 gridRange=probesMax - probesMin;
vec3 probeSpacing=gridRange/res;
vec3 samplePos=worldPos+worldNormal*probeSpacing*.5;
vec3 uvw=clamp( ( samplePos - probesMin )/gridRange,.5/res,1. - .5/res );
float nz         =res.z;
float paddedSlices=nz+2.;
float atlasDepth =7.*paddedSlices;
float uvZBase    =uvw.z*nz+1.;
vec4 s0=texture( probesSH,vec3( uvw.xy,( uvZBase                       )/atlasDepth ) );
vec4 s1=texture( probesSH,vec3( uvw.xy,( uvZBase+      paddedSlices   )/atlasDepth ) );
vec4 s2=texture( probesSH,vec3( uvw.xy,( uvZBase+2.*paddedSlices   )/atlasDepth ) );
vec4 s3=texture( probesSH,vec3( uvw.xy,( uvZBase+3.*paddedSlices   )/atlasDepth ) );
vec4 s4=texture( probesSH,vec3( uvw.xy,( uvZBase+4.*paddedSlices   )/atlasDepth ) );
vec4 s5=texture( probesSH,vec3( uvw.xy,( uvZBase+5.*paddedSlices   )/atlasDepth ) );
vec4 s6=texture( probesSH,vec3( uvw.xy,( uvZBase+6.*paddedSlices   )/atlasDepth ) );
vec3 c0=s0.xyz;
vec3 c1=vec3( s0.w,s1.xy );
vec3 c2=vec3( s1.zw,s2.x );
vec3 c3=s2.yzw;
vec3 c4=s3.xyz;
vec3 c5=vec3( s3.w,s4.xy );
vec3 c6=vec3( s4.zw,s5.x );
vec3 c7=s5.yzw;
vec3 c8=s6.xyz;
float x=worldNormal.x,y=worldNormal.y,z=worldNormal.z;
vec3 result=c0*.886227;
result+=c1*2.*.511664*y;
result+=c2*2.*.511664*z;
result+=c3*2.*.511664*x;
result+=c4*2.*.429043*x*y;
result+=c5*2.*.429043*y*z;
result+=c6*( .743125*z*z - .247708 );
result+=c7*2.*.429043*x*z;
result+=c8*.429043*( x*x - y*y );
return max( result,vec3( .0 ) );
}
#endif
`,lights_fragment_begin:`
/**
*This is a template that can be used to light a material,it uses pluggable
*RenderEquations (RE)for specific lighting scenarios.
*
*Instructions for use:
*- Ensure that both RE_Direct,RE_IndirectDiffuse and RE_IndirectSpecular are defined
*- Create a material parameter that is to be passed as the third parameter to your lighting functions.
*
*TODO:
*- Add area light support.
*- Add sphere light support.
*- Add diffuse light probe (irradiance cubemap) support.
*/
vec3 geometryPosition=- vViewPosition;
vec3 geometryNormal=normal;
vec3 geometryViewDir=( isOrthographic )?vec3( 0,0,1 ):normalize( vViewPosition );
vec3 geometryClearcoatNormal=vec3( .0 );
#ifdef USE_CLEARCOAT
geometryClearcoatNormal=clearcoatNormal;
#endif
#ifdef USE_IRIDESCENCE
float dotNVi=saturate( dot( normal,geometryViewDir ) );
if ( material.iridescenceThickness==.0 ){
material.iridescence=.0;
}else{
material.iridescence=saturate( material.iridescence );
}
if ( material.iridescence>.0 ){
vec3 iridescenceFresnelDielectric=evalIridescence( 1.,material.iridescenceIOR,dotNVi,material.iridescenceThickness,material.specularColor );
vec3 iridescenceFresnelMetallic=evalIridescence( 1.,material.iridescenceIOR,dotNVi,material.iridescenceThickness,material.diffuseColor );
material.iridescenceFresnel=mix( iridescenceFresnelDielectric,iridescenceFresnelMetallic,material.metalness );
material.iridescenceF0Dielectric=Schlick_to_F0( iridescenceFresnelDielectric,1.,dotNVi );
material.iridescenceF0Metallic=Schlick_to_F0( iridescenceFresnelMetallic,1.,dotNVi );
}
#endif
#ifdef STANDARD
float dotNVms=saturate( dot( geometryNormal,geometryViewDir ) );
material.dfg=texture2D( dfgLUT,vec2( material.roughness,dotNVms ) ).rg;
#if ( NUM_SUN_LIGHTS > 0 || NUM_DIR_LIGHTS > 0 || NUM_POINT_LIGHTS > 0 || NUM_SPOT_LIGHTS > 0 )
float EssMs=material.dfg.x+material.dfg.y;
material.multiScatteringCompensation=1.+material.specularColorBlended*( 1./EssMs - 1. );
#endif
#endif
IncidentLight directLight;
#if ( NUM_POINT_LIGHTS > 0 ) && defined( RE_Direct )
PointLight pointLight;
#if defined( USE_SHADOWMAP ) && NUM_POINT_LIGHT_SHADOWS > 0
PointLightShadow pointLightShadow;
#endif
#pragma unroll_loop_start
for ( int i=0;i<NUM_POINT_LIGHTS;i++){
pointLight=pointLights[ i ];
getPointLightInfo( pointLight,geometryPosition,directLight );
#if defined( USE_SHADOWMAP ) && ( UNROLLED_LOOP_INDEX < NUM_POINT_LIGHT_SHADOWS ) && ( defined( SHADOWMAP_TYPE_PCF ) || defined( SHADOWMAP_TYPE_BASIC ) )
pointLightShadow=pointLightShadows[ i ];
directLight.color*=( directLight.visible && receiveShadow )?getPointShadow( pointShadowMap[ i ],pointLightShadow.shadowMapSize,pointLightShadow.shadowIntensity,pointLightShadow.shadowBias,pointLightShadow.shadowRadius,vPointShadowCoord[ i ],pointLightShadow.shadowCameraNear,pointLightShadow.shadowCameraFar ):1.;
#endif
RE_Direct( directLight,geometryPosition,geometryNormal,geometryViewDir,geometryClearcoatNormal,material,reflectedLight );
}
#pragma unroll_loop_end
#endif
#if ( NUM_SPOT_LIGHTS > 0 ) && defined( RE_Direct )
SpotLight spotLight;
vec4 spotColor;
vec3 spotLightCoord;
bool inSpotLightMap;
#if defined( USE_SHADOWMAP ) && NUM_SPOT_LIGHT_SHADOWS > 0
SpotLightShadow spotLightShadow;
#endif
#pragma unroll_loop_start
for ( int i=0;i<NUM_SPOT_LIGHTS;i++){
spotLight=spotLights[ i ];
getSpotLightInfo( spotLight,geometryPosition,directLight );
#if ( UNROLLED_LOOP_INDEX < NUM_SPOT_LIGHT_SHADOWS_WITH_MAPS )
#define SPOT_LIGHT_MAP_INDEX UNROLLED_LOOP_INDEX
#elif ( UNROLLED_LOOP_INDEX < NUM_SPOT_LIGHT_SHADOWS )
#define SPOT_LIGHT_MAP_INDEX NUM_SPOT_LIGHT_MAPS
#else
#define SPOT_LIGHT_MAP_INDEX ( UNROLLED_LOOP_INDEX - NUM_SPOT_LIGHT_SHADOWS + NUM_SPOT_LIGHT_SHADOWS_WITH_MAPS )
#endif
#if ( SPOT_LIGHT_MAP_INDEX < NUM_SPOT_LIGHT_MAPS )
spotLightCoord=vSpotLightCoord[ i ].xyz/vSpotLightCoord[ i ].w;
inSpotLightMap=all( lessThan( abs( spotLightCoord*2. - 1. ),vec3( 1. ) ) );
spotColor=texture2D( spotLightMap[ SPOT_LIGHT_MAP_INDEX ],spotLightCoord.xy );
directLight.color=inSpotLightMap?directLight.color*spotColor.rgb:directLight.color;
#endif
#undef SPOT_LIGHT_MAP_INDEX
#if defined( USE_SHADOWMAP ) && ( UNROLLED_LOOP_INDEX < NUM_SPOT_LIGHT_SHADOWS )
spotLightShadow=spotLightShadows[ i ];
directLight.color*=( directLight.visible && receiveShadow )?getShadow( spotShadowMap[ i ],spotLightShadow.shadowMapSize,spotLightShadow.shadowIntensity,spotLightShadow.shadowBias,spotLightShadow.shadowRadius,vSpotLightCoord[ i ] ):1.;
#endif
RE_Direct( directLight,geometryPosition,geometryNormal,geometryViewDir,geometryClearcoatNormal,material,reflectedLight );
}
#pragma unroll_loop_end
#endif
#if ( NUM_SUN_LIGHTS > 0 ) && defined( RE_Direct )
SunLight sunLight;
#if defined( USE_SHADOWMAP ) && NUM_SUN_LIGHT_SHADOWS > 0
SunLightShadow sunLightShadow;
#endif
#pragma unroll_loop_start
for ( int i=0;i<NUM_SUN_LIGHTS;i++){
sunLight=sunLights[ i ];
getSunLightInfo( sunLight,directLight );
#if defined( USE_SHADOWMAP ) && ( UNROLLED_LOOP_INDEX < NUM_SUN_LIGHT_SHADOWS )
sunLightShadow=sunLightShadows[ i ];
directLight.color*=( directLight.visible && receiveShadow )?getSunShadow( sunShadowMap[ i ],sunLightShadow,UNROLLED_LOOP_INDEX ):1.;
#endif
RE_Direct( directLight,geometryPosition,geometryNormal,geometryViewDir,geometryClearcoatNormal,material,reflectedLight );
}
#pragma unroll_loop_end
#endif
#if ( NUM_DIR_LIGHTS > 0 ) && defined( RE_Direct )
DirectionalLight directionalLight;
#if defined( USE_SHADOWMAP ) && NUM_DIR_LIGHT_SHADOWS > 0
DirectionalLightShadow directionalLightShadow;
#endif
#pragma unroll_loop_start
for ( int i=0;i<NUM_DIR_LIGHTS;i++){
directionalLight=directionalLights[ i ];
getDirectionalLightInfo( directionalLight,directLight );
#if defined( USE_SHADOWMAP ) && ( UNROLLED_LOOP_INDEX < NUM_DIR_LIGHT_SHADOWS )
directionalLightShadow=directionalLightShadows[ i ];
directLight.color*=( directLight.visible && receiveShadow )?getShadow( directionalShadowMap[ i ],directionalLightShadow.shadowMapSize,directionalLightShadow.shadowIntensity,directionalLightShadow.shadowBias,directionalLightShadow.shadowRadius,vDirectionalShadowCoord[ i ] ):1.;
#endif
RE_Direct( directLight,geometryPosition,geometryNormal,geometryViewDir,geometryClearcoatNormal,material,reflectedLight );
}
#pragma unroll_loop_end
#endif
#if ( NUM_RECT_AREA_LIGHTS > 0 ) && defined( RE_Direct_RectArea )
RectAreaLight rectAreaLight;
#pragma unroll_loop_start
for ( int i=0;i<NUM_RECT_AREA_LIGHTS;i++){
rectAreaLight=rectAreaLights[ i ];
RE_Direct_RectArea( rectAreaLight,geometryPosition,geometryNormal,geometryViewDir,geometryClearcoatNormal,material,reflectedLight );
}
#pragma unroll_loop_end
#endif
#if defined( RE_IndirectDiffuse )
vec3 iblIrradiance=vec3( .0 );
vec3 irradiance=getAmbientLightIrradiance( ambientLightColor );
#if defined( USE_LIGHT_PROBES )
irradiance+=getLightProbeIrradiance( lightProbe,geometryNormal );
#endif
#if ( NUM_HEMI_LIGHTS > 0 )
#pragma unroll_loop_start
for ( int i=0;i<NUM_HEMI_LIGHTS;i++){
irradiance+=getHemisphereLightIrradiance( hemisphereLights[ i ],geometryNormal );
}
#pragma unroll_loop_end
#endif
#if NUM_LIGHT_PROBE_GRIDS > 0
vec3 probeWorldPos=( ( vec4( geometryPosition,1. ) - viewMatrix[ 3 ] )*viewMatrix ).xyz;
vec3 probeWorldNormal=transformNormalByInverseViewMatrix( geometryNormal,viewMatrix );
int probeGrid=- 1;
#pragma unroll_loop_start
for ( int i=0;i<NUM_LIGHT_PROBE_GRIDS;i++){
if ( isInsideLightProbeGrid( probeWorldPos,probeWorldNormal,probesMin[ i ],probesMax[ i ],probesResolution[ i ] ) ) probeGrid=UNROLLED_LOOP_INDEX;
}
#pragma unroll_loop_end
#pragma unroll_loop_start
for ( int i=0;i<NUM_LIGHT_PROBE_GRIDS;i++){
if ( probeGrid==UNROLLED_LOOP_INDEX ) irradiance+=getLightProbeGridIrradiance( probesSH[ i ],probesMin[ i ],probesMax[ i ],probesResolution[ i ],probeWorldPos,probeWorldNormal );
}
#pragma unroll_loop_end
#endif
#endif
#if defined( RE_IndirectSpecular )
vec3 radiance=vec3( .0 );
vec3 clearcoatRadiance=vec3( .0 );
#endif
`,lights_fragment_maps:`
#if defined( RE_IndirectDiffuse )
#ifdef USE_LIGHTMAP
vec4 lightMapTexel=texture2D( lightMap,vLightMapUv );
vec3 lightMapIrradiance=lightMapTexel.rgb*lightMapIntensity;
irradiance+=lightMapIrradiance;
#endif
#if defined( USE_ENVMAP ) && defined( ENVMAP_TYPE_PMREM )
#if defined( STANDARD ) || defined( LAMBERT ) || defined( PHONG )
iblIrradiance+=getIBLIrradiance( geometryNormal );
#endif
#endif
#endif
#if defined( USE_ENVMAP ) && defined( RE_IndirectSpecular )
#ifdef USE_ANISOTROPY
vec3 iblRadiance=getIBLAnisotropyRadiance( geometryViewDir,geometryNormal,material.roughness,material.anisotropyB,material.anisotropy );
#else
vec3 iblRadiance=getIBLRadiance( geometryViewDir,geometryNormal,material.roughness );
#endif
#ifdef USE_RETROREFLECTION
#ifdef USE_ANISOTROPY
vec3 retroIBLRadiance=getIBLAnisotropyRetroRadiance( geometryViewDir,geometryNormal,material.roughness,material.anisotropyB,material.anisotropy );
#else
vec3 retroIBLRadiance=getIBLRetroRadiance( geometryViewDir,geometryNormal,material.roughness );
#endif
iblRadiance=mix( iblRadiance,retroIBLRadiance,saturate( material.retroreflectivity ) );
#endif
radiance+=iblRadiance;
#ifdef USE_CLEARCOAT
clearcoatRadiance+=getIBLRadiance( geometryViewDir,geometryClearcoatNormal,material.clearcoatRoughness );
#endif
#endif
`,lights_pars_begin:`
uniform bool receiveShadow;
uniform vec3 ambientLightColor;
#if defined( USE_LIGHT_PROBES )
uniform vec3 lightProbe[ 9 ];
#endif
vec3 shGetIrradianceAt( in vec3 normal,in vec3 shCoefficients[ 9 ] ){
float x=normal.x,y=normal.y,z=normal.z;
vec3 result=shCoefficients[ 0 ]*.886227;
result+=shCoefficients[ 1 ]*2.*.511664*y;
result+=shCoefficients[ 2 ]*2.*.511664*z;
result+=shCoefficients[ 3 ]*2.*.511664*x;
result+=shCoefficients[ 4 ]*2.*.429043*x*y;
result+=shCoefficients[ 5 ]*2.*.429043*y*z;
result+=shCoefficients[ 6 ]*( .743125*z*z - .247708 );
result+=shCoefficients[ 7 ]*2.*.429043*x*z;
result+=shCoefficients[ 8 ]*.429043*( x*x - y*y );
return result;
}
vec3 getLightProbeIrradiance( const in vec3 lightProbe[ 9 ],const in vec3 normal ){
vec3 worldNormal=transformNormalByInverseViewMatrix( normal,viewMatrix );
vec3 irradiance=shGetIrradianceAt( worldNormal,lightProbe );
return irradiance;
}
vec3 getAmbientLightIrradiance( const in vec3 ambientLightColor ){
vec3 irradiance=ambientLightColor;
return irradiance;
}
float getDistanceAttenuation( const in float lightDistance,const in float cutoffDistance,const in float decayExponent ){
float distanceFalloff=1./max( pow( lightDistance,decayExponent ),.01 );
if ( cutoffDistance>.0 ){
distanceFalloff*=pow2( saturate( 1. - pow4( lightDistance/cutoffDistance ) ) );
}
return distanceFalloff;
}
float getSpotAttenuation( const in float coneCosine,const in float penumbraCosine,const in float angleCosine ){
return smoothstep( coneCosine,penumbraCosine,angleCosine );
}
#if NUM_SUN_LIGHTS > 0
struct SunLight{
vec3 direction;
vec3 color;
};
uniform SunLight sunLights[ NUM_SUN_LIGHTS ];
void getSunLightInfo( const in SunLight sunLight,out IncidentLight light ){
light.color=sunLight.color;
light.direction=sunLight.direction;
light.visible=true;
}
#endif
#if NUM_DIR_LIGHTS > 0
struct DirectionalLight{
vec3 direction;
vec3 color;
};
uniform DirectionalLight directionalLights[ NUM_DIR_LIGHTS ];
void getDirectionalLightInfo( const in DirectionalLight directionalLight,out IncidentLight light ){
light.color=directionalLight.color;
light.direction=directionalLight.direction;
light.visible=true;
}
#endif
#if NUM_POINT_LIGHTS > 0
struct PointLight{
vec3 position;
vec3 color;
float distance;
float decay;
};
uniform PointLight pointLights[ NUM_POINT_LIGHTS ];
void getPointLightInfo( const in PointLight pointLight,const in vec3 geometryPosition,out IncidentLight light ){
vec3 lVector=pointLight.position - geometryPosition;
light.direction=normalize( lVector );
float lightDistance=length( lVector );
light.color=pointLight.color;
light.color*=getDistanceAttenuation( lightDistance,pointLight.distance,pointLight.decay );
light.visible=( light.color !=vec3( .0 ) );
}
#endif
#if NUM_SPOT_LIGHTS > 0
struct SpotLight{
vec3 position;
vec3 direction;
vec3 color;
float distance;
float decay;
float coneCos;
float penumbraCos;
};
uniform SpotLight spotLights[ NUM_SPOT_LIGHTS ];
void getSpotLightInfo( const in SpotLight spotLight,const in vec3 geometryPosition,out IncidentLight light ){
vec3 lVector=spotLight.position - geometryPosition;
light.direction=normalize( lVector );
float angleCos=dot( light.direction,spotLight.direction );
float spotAttenuation=getSpotAttenuation( spotLight.coneCos,spotLight.penumbraCos,angleCos );
if ( spotAttenuation>.0 ){
float lightDistance=length( lVector );
light.color=spotLight.color*spotAttenuation;
light.color*=getDistanceAttenuation( lightDistance,spotLight.distance,spotLight.decay );
light.visible=( light.color !=vec3( .0 ) );
}else{
light.color=vec3( .0 );
light.visible=false;
}
}
#endif
#if NUM_RECT_AREA_LIGHTS > 0
struct RectAreaLight{
vec3 color;
vec3 position;
vec3 halfWidth;
vec3 halfHeight;
};
uniform sampler2D ltc_1;
uniform sampler2D ltc_2;
uniform RectAreaLight rectAreaLights[ NUM_RECT_AREA_LIGHTS ];
#endif
#if NUM_HEMI_LIGHTS > 0
struct HemisphereLight{
vec3 direction;
vec3 skyColor;
vec3 groundColor;
};
uniform HemisphereLight hemisphereLights[ NUM_HEMI_LIGHTS ];
vec3 getHemisphereLightIrradiance( const in HemisphereLight hemiLight,const in vec3 normal ){
float dotNL=dot( normal,hemiLight.direction );
float hemiDiffuseWeight=.5*dotNL+.5;
vec3 irradiance=mix( hemiLight.groundColor,hemiLight.skyColor,hemiDiffuseWeight );
return irradiance;
}
#endif
#include <lightprobes_pars_fragment>
`,lights_physical_fragment:`
PhysicalMaterial material;
material.diffuseColor=diffuseColor.rgb;
material.diffuseContribution=diffuseColor.rgb*( 1. - metalnessFactor );
material.metalness=metalnessFactor;
vec3 dxy=max( abs( dFdx( nonPerturbedNormal ) ),abs( dFdy( nonPerturbedNormal ) ) );
float geometryRoughness=max( max( dxy.x,dxy.y ),dxy.z );
material.roughness=max( roughnessFactor,.045 );
material.roughness+=geometryRoughness;
material.roughness=min( material.roughness,1. );
#ifdef USE_DIFFUSE_ROUGHNESS
float diffuseRoughnessFactor=diffuseRoughness;
#ifdef USE_DIFFUSE_ROUGHNESSMAP
diffuseRoughnessFactor*=texture2D( diffuseRoughnessMap,vDiffuseRoughnessMapUv ).r;
#endif
material.diffuseRoughness=saturate( diffuseRoughnessFactor );
#endif
#ifdef IOR
material.ior=ior;
#ifdef USE_SPECULAR
float specularIntensityFactor=specularIntensity;
vec3 specularColorFactor=specularColor;
#ifdef USE_SPECULAR_COLORMAP
specularColorFactor*=texture2D( specularColorMap,vSpecularColorMapUv ).rgb;
#endif
#ifdef USE_SPECULAR_INTENSITYMAP
specularIntensityFactor*=texture2D( specularIntensityMap,vSpecularIntensityMapUv ).a;
#endif
material.specularF90=mix( specularIntensityFactor,1.,metalnessFactor );
#else
float specularIntensityFactor=1.;
vec3 specularColorFactor=vec3( 1. );
material.specularF90=1.;
#endif
material.specularColor=min( pow2( ( material.ior - 1. )/( material.ior+1. ) )*specularColorFactor,vec3( 1. ) )*specularIntensityFactor;
material.specularColorBlended=mix( material.specularColor,diffuseColor.rgb,metalnessFactor );
#else
material.specularColor=vec3( .04 );
material.specularColorBlended=mix( material.specularColor,diffuseColor.rgb,metalnessFactor );
material.specularF90=1.;
#endif
#ifdef USE_CLEARCOAT
material.clearcoat=clearcoat;
material.clearcoatRoughness=clearcoatRoughness;
material.clearcoatF0=vec3( .04 );
material.clearcoatF90=1.;
#ifdef USE_CLEARCOATMAP
material.clearcoat*=texture2D( clearcoatMap,vClearcoatMapUv ).x;
#endif
#ifdef USE_CLEARCOAT_ROUGHNESSMAP
material.clearcoatRoughness*=texture2D( clearcoatRoughnessMap,vClearcoatRoughnessMapUv ).y;
#endif
material.clearcoat=saturate( material.clearcoat );
material.clearcoatRoughness=max( material.clearcoatRoughness,.045 );
material.clearcoatRoughness+=geometryRoughness;
material.clearcoatRoughness=min( material.clearcoatRoughness,1. );
#endif
#ifdef USE_DISPERSION
material.dispersion=dispersion;
#endif
#ifdef USE_RETROREFLECTION
material.retroreflectivity=retroreflectivity;
#endif
#ifdef USE_IRIDESCENCE
material.iridescence=iridescence;
material.iridescenceIOR=iridescenceIOR;
#ifdef USE_IRIDESCENCEMAP
material.iridescence*=texture2D( iridescenceMap,vIridescenceMapUv ).r;
#endif
#ifdef USE_IRIDESCENCE_THICKNESSMAP
material.iridescenceThickness=(iridescenceThicknessMaximum - iridescenceThicknessMinimum)*texture2D( iridescenceThicknessMap,vIridescenceThicknessMapUv ).g+iridescenceThicknessMinimum;
#else
material.iridescenceThickness=iridescenceThicknessMaximum;
#endif
#endif
#ifdef USE_SHEEN
material.sheenColor=sheenColor;
#ifdef USE_SHEEN_COLORMAP
material.sheenColor*=texture2D( sheenColorMap,vSheenColorMapUv ).rgb;
#endif
material.sheenRoughness=clamp( sheenRoughness,.0001,1. );
#ifdef USE_SHEEN_ROUGHNESSMAP
material.sheenRoughness*=texture2D( sheenRoughnessMap,vSheenRoughnessMapUv ).a;
#endif
#endif
#ifdef USE_ANISOTROPY
#ifdef USE_ANISOTROPYMAP
mat2 anisotropyMat=mat2( anisotropyVector.x,anisotropyVector.y,- anisotropyVector.y,anisotropyVector.x );
vec3 anisotropyPolar=texture2D( anisotropyMap,vAnisotropyMapUv ).rgb;
vec2 anisotropyV=anisotropyMat*normalize( 2.*anisotropyPolar.rg - vec2( 1. ) )*anisotropyPolar.b;
#else
vec2 anisotropyV=anisotropyVector;
#endif
material.anisotropy=length( anisotropyV );
if( material.anisotropy==.0 ){
anisotropyV=vec2( 1.,.0 );
}else{
anisotropyV/=material.anisotropy;
material.anisotropy=saturate( material.anisotropy );
}
material.alphaT=mix( pow2( material.roughness ),1.,pow2( material.anisotropy ) );
material.anisotropyT=tbn[ 0 ]*anisotropyV.x+tbn[ 1 ]*anisotropyV.y;
material.anisotropyB=tbn[ 1 ]*anisotropyV.x - tbn[ 0 ]*anisotropyV.y;
#endif
`,lights_physical_pars_fragment:`
uniform sampler2D dfgLUT;
struct PhysicalMaterial{
vec3 diffuseColor;
vec3 diffuseContribution;
vec3 specularColor;
vec3 specularColorBlended;
float roughness;
float metalness;
float specularF90;
float dispersion;
vec2 dfg;
vec3 multiScatteringCompensation;
#ifdef USE_DIFFUSE_ROUGHNESS
float diffuseRoughness;
#endif
#ifdef USE_RETROREFLECTION
float retroreflectivity;
#endif
#ifdef USE_CLEARCOAT
float clearcoat;
float clearcoatRoughness;
vec3 clearcoatF0;
float clearcoatF90;
#endif
#ifdef USE_IRIDESCENCE
float iridescence;
float iridescenceIOR;
float iridescenceThickness;
vec3 iridescenceFresnel;
vec3 iridescenceF0Dielectric;
vec3 iridescenceF0Metallic;
#endif
#ifdef USE_SHEEN
vec3 sheenColor;
float sheenRoughness;
#endif
#ifdef IOR
float ior;
#endif
#ifdef USE_TRANSMISSION
float transmission;
float transmissionAlpha;
float thickness;
float attenuationDistance;
vec3 attenuationColor;
#endif
#ifdef USE_ANISOTROPY
float anisotropy;
float alphaT;
vec3 anisotropyT;
vec3 anisotropyB;
#endif
};
vec3 clearcoatSpecularDirect=vec3( .0 );
vec3 clearcoatSpecularIndirect=vec3( .0 );
vec3 sheenSpecularDirect=vec3( .0 );
vec3 sheenSpecularIndirect=vec3(.0 );
vec3 Schlick_to_F0( const in vec3 f,const in float f90,const in float dotVH ){
float x=clamp( 1. - dotVH,.0,1. );
float x2=x*x;
float x5=clamp( x*x2*x2,.0,.9999 );
return ( f - vec3( f90 )*x5 )/( 1. - x5 );
}
#ifdef USE_DIFFUSE_ROUGHNESS
const float EON_EPSILON=1e-7;
float FON_DirectionalAlbedo( const in float mu,const in float roughness,const in float A ){
float muComp=1. - mu;
float gOverPi=muComp*( .0571085289+muComp*( .491881867+muComp*( - .332181442+muComp*.0714429953 ) ) );
return A*( 1.+roughness*gOverPi );
}
vec3 BRDF_EON( const in vec3 lightDir,const in vec3 viewDir,const in vec3 normal,const in vec3 diffuseColor,const in float roughness ){
vec3 rho=saturate( diffuseColor );
if ( roughness<=EON_EPSILON ) return BRDF_Lambert( rho );
float dotNL=saturate( dot( normal,lightDir ) );
float dotNV=saturate( dot( normal,viewDir ) );
float s=dot( lightDir,viewDir ) - dotNL*dotNV;
float sOverT=( s>.0 )?s/max( max( dotNL,dotNV ),EON_EPSILON ):s;
float A=1./( 1.+( .5 - 2./( 3.*PI ) )*roughness );
vec3 singleScatter=rho*RECIPROCAL_PI*A*( 1.+roughness*sOverT );
float averageAlbedo=A*( 1.+( 2./3. - 28./( 15.*PI ) )*roughness );
float albedoV=FON_DirectionalAlbedo( dotNV,roughness,A );
float albedoL=FON_DirectionalAlbedo( dotNL,roughness,A );
vec3 rhoMultiScatter=rho*rho*averageAlbedo/max( vec3( EON_EPSILON ),vec3( 1. ) - rho*( 1. - averageAlbedo ) );
vec3 multiScatter=rhoMultiScatter*RECIPROCAL_PI
*max( EON_EPSILON,1. - albedoV )
*max( EON_EPSILON,1. - albedoL )
/max( EON_EPSILON,1. - averageAlbedo );
return singleScatter+multiScatter;
}
vec3 EON_DirectionalAlbedo( const in vec3 diffuseColor,const in float roughness,const in float dotNV ){
vec3 rho=saturate( diffuseColor );
if ( roughness<=EON_EPSILON ) return rho;
float A=1./( 1.+( .5 - 2./( 3.*PI ) )*roughness );
float directionalAlbedo=FON_DirectionalAlbedo( dotNV,roughness,A );
float averageAlbedo=A*( 1.+( 2./3. - 28./( 15.*PI ) )*roughness );
vec3 rhoMultiScatter=rho*rho*averageAlbedo/max( vec3( EON_EPSILON ),vec3( 1. ) - rho*( 1. - averageAlbedo ) );
return rho*directionalAlbedo+rhoMultiScatter*( 1. - directionalAlbedo );
}
#endif
float V_GGX_SmithCorrelated( const in float alpha,const in float dotNL,const in float dotNV ){
float a2=pow2( alpha );
float gv=dotNL*sqrt( a2+( 1. - a2 )*pow2( dotNV ) );
float gl=dotNV*sqrt( a2+( 1. - a2 )*pow2( dotNL ) );
return .5/max( gv+gl,EPSILON );
}
float D_GGX( const in float alpha,const in float dotNH ){
float a2=pow2( alpha );
float denom=pow2( dotNH )*( a2 - 1. )+1.;
return RECIPROCAL_PI*a2/pow2( denom );
}
#ifdef USE_ANISOTROPY
float V_GGX_SmithCorrelated_Anisotropic( const in float alphaT,const in float alphaB,const in float dotTV,const in float dotBV,const in float dotTL,const in float dotBL,const in float dotNV,const in float dotNL ){
float gv=dotNL*length( vec3( alphaT*dotTV,alphaB*dotBV,dotNV ) );
float gl=dotNV*length( vec3( alphaT*dotTL,alphaB*dotBL,dotNL ) );
return .5/max( gv+gl,EPSILON );
}
float D_GGX_Anisotropic( const in float alphaT,const in float alphaB,const in float dotNH,const in float dotTH,const in float dotBH ){
float a2=alphaT*alphaB;
highp vec3 v=vec3( alphaB*dotTH,alphaT*dotBH,a2*dotNH );
highp float v2=dot( v,v );
float w2=a2/v2;
return RECIPROCAL_PI*a2*pow2 ( w2 );
}
#endif
#ifdef USE_CLEARCOAT
vec3 BRDF_GGX_Clearcoat( const in vec3 lightDir,const in vec3 viewDir,const in vec3 normal,const in PhysicalMaterial material){
vec3 f0=material.clearcoatF0;
float f90=material.clearcoatF90;
float roughness=max( material.clearcoatRoughness,.045 );
float alpha=pow2( roughness );
vec3 halfDir=normalize( lightDir+viewDir );
float dotNL=saturate( dot( normal,lightDir ) );
float dotNV=saturate( dot( normal,viewDir ) );
float dotNH=saturate( dot( normal,halfDir ) );
float dotVH=saturate( dot( viewDir,halfDir ) );
vec3 F=F_Schlick( f0,f90,dotVH );
float V=V_GGX_SmithCorrelated( alpha,dotNL,dotNV );
float D=D_GGX( alpha,dotNH );
return F*( V*D );
}
#endif
vec3 BRDF_GGX( const in vec3 lightDir,const in vec3 viewDir,const in vec3 normal,const in PhysicalMaterial material ){
vec3 f0=material.specularColorBlended;
float f90=material.specularF90;
float roughness=max( material.roughness,.045 );
float alpha=pow2( roughness );
vec3 halfDir=normalize( lightDir+viewDir );
float dotNL=saturate( dot( normal,lightDir ) );
float dotNV=saturate( dot( normal,viewDir ) );
float dotNH=saturate( dot( normal,halfDir ) );
float dotVH=saturate( dot( viewDir,halfDir ) );
vec3 F=F_Schlick( f0,f90,dotVH );
#ifdef USE_IRIDESCENCE
F=mix( F,material.iridescenceFresnel,material.iridescence );
#endif
#ifdef USE_ANISOTROPY
float dotTL=dot( material.anisotropyT,lightDir );
float dotTV=dot( material.anisotropyT,viewDir );
float dotTH=dot( material.anisotropyT,halfDir );
float dotBL=dot( material.anisotropyB,lightDir );
float dotBV=dot( material.anisotropyB,viewDir );
float dotBH=dot( material.anisotropyB,halfDir );
float alphaT=max( material.alphaT,alpha );
float V=V_GGX_SmithCorrelated_Anisotropic( alphaT,alpha,dotTV,dotBV,dotTL,dotBL,dotNV,dotNL );
float D=D_GGX_Anisotropic( alphaT,alpha,dotNH,dotTH,dotBH );
#else
float V=V_GGX_SmithCorrelated( alpha,dotNL,dotNV );
float D=D_GGX( alpha,dotNH );
#endif
return F*( V*D );
}
vec2 LTC_Uv( const in vec3 N,const in vec3 V,const in float roughness ){
const float LUT_SIZE=64.;
const float LUT_SCALE=( LUT_SIZE - 1. )/LUT_SIZE;
const float LUT_BIAS=.5/LUT_SIZE;
float dotNV=saturate( dot( N,V ) );
vec2 uv=vec2( roughness,sqrt( 1. - dotNV ) );
uv=uv*LUT_SCALE+LUT_BIAS;
return uv;
}
float LTC_ClippedSphereFormFactor( const in vec3 f ){
float l=length( f );
return max( ( l*l+f.z )/( l+1. ),.0 );
}
vec3 LTC_EdgeVectorFormFactor( const in vec3 v1,const in vec3 v2 ){
float x=dot( v1,v2 );
float y=abs( x );
float a=.8543985+( .4965155+.0145206*y )*y;
float b=3.4175940+( 4.1616724+y )*y;
float v=a/b;
float theta_sintheta=( x>.0 )?v:.5*inversesqrt( max( 1. - x*x,1e-7 ) ) - v;
return cross( v1,v2 )*theta_sintheta;
}
vec3 LTC_Evaluate( const in vec3 N,const in vec3 V,const in vec3 P,const in mat3 mInv,const in vec3 rectCoords[ 4 ] ){
vec3 v1=rectCoords[ 1 ] - rectCoords[ 0 ];
vec3 v2=rectCoords[ 3 ] - rectCoords[ 0 ];
vec3 lightNormal=cross( v1,v2 );
if( dot( lightNormal,P - rectCoords[ 0 ] )<.0 ) return vec3( .0 );
vec3 T1,T2;
T1=normalize( V - N*dot( V,N ) );
T2=- cross( N,T1 );
mat3 mat=mInv*transpose( mat3( T1,T2,N ) );
vec3 coords[ 4 ];
coords[ 0 ]=mat*( rectCoords[ 0 ] - P );
coords[ 1 ]=mat*( rectCoords[ 1 ] - P );
coords[ 2 ]=mat*( rectCoords[ 2 ] - P );
coords[ 3 ]=mat*( rectCoords[ 3 ] - P );
coords[ 0 ]=normalize( coords[ 0 ] );
coords[ 1 ]=normalize( coords[ 1 ] );
coords[ 2 ]=normalize( coords[ 2 ] );
coords[ 3 ]=normalize( coords[ 3 ] );
vec3 vectorFormFactor=vec3( .0 );
vectorFormFactor+=LTC_EdgeVectorFormFactor( coords[ 0 ],coords[ 1 ] );
vectorFormFactor+=LTC_EdgeVectorFormFactor( coords[ 1 ],coords[ 2 ] );
vectorFormFactor+=LTC_EdgeVectorFormFactor( coords[ 2 ],coords[ 3 ] );
vectorFormFactor+=LTC_EdgeVectorFormFactor( coords[ 3 ],coords[ 0 ] );
float result=LTC_ClippedSphereFormFactor( vectorFormFactor );
/*
float len=length( vectorFormFactor );
float z=vectorFormFactor.z/len;
const float LUT_SIZE=64.;
const float LUT_SCALE=( LUT_SIZE - 1. )/LUT_SIZE;
const float LUT_BIAS=.5/LUT_SIZE;
vec2 uv=vec2( z*.5+.5,len );
uv=uv*LUT_SCALE+LUT_BIAS;
float scale=texture2D( ltc_2,uv ).w;
float result=len*scale;
*/
return vec3( result );
}
#if defined( USE_SHEEN )
float D_Charlie( float roughness,float dotNH ){
float alpha=pow2( roughness );
float invAlpha=1./alpha;
float cos2h=dotNH*dotNH;
float sin2h=max( 1. - cos2h,.0078125 );
return ( 2.+invAlpha )*pow( sin2h,invAlpha*.5 )/( 2.*PI );
}
float V_Neubelt( float dotNV,float dotNL ){
return saturate( 1./( 4.*( dotNL+dotNV - dotNL*dotNV ) ) );
}
vec3 BRDF_Sheen( const in vec3 lightDir,const in vec3 viewDir,const in vec3 normal,vec3 sheenColor,const in float sheenRoughness ){
vec3 halfDir=normalize( lightDir+viewDir );
float dotNL=saturate( dot( normal,lightDir ) );
float dotNV=saturate( dot( normal,viewDir ) );
float dotNH=saturate( dot( normal,halfDir ) );
float D=D_Charlie( sheenRoughness,dotNH );
float V=V_Neubelt( dotNV,dotNL );
return sheenColor*( D*V );
}
#endif
float IBLSheenBRDF( const in vec3 normal,const in vec3 viewDir,const in float roughness ){
float dotNV=saturate( dot( normal,viewDir ) );
float r2=roughness*roughness;
float rInv=1./( roughness+.1 );
float a=-1.9362+1.0678*roughness+.4573*r2 - .8469*rInv;
float b=-.6014+.5538*roughness - .4670*r2 - .1255*rInv;
float DG=exp( a*dotNV+b );
return saturate( DG );
}
vec3 EnvironmentBRDF( const in vec3 normal,const in vec3 viewDir,const in vec3 specularColor,const in float specularF90,const in float roughness ){
float dotNV=saturate( dot( normal,viewDir ) );
vec2 fab=texture2D( dfgLUT,vec2( roughness,dotNV ) ).rg;
return specularColor*fab.x+specularF90*fab.y;
}
#ifdef USE_IRIDESCENCE
void computeMultiscatteringIridescence( const in vec2 fab,const in vec3 specularColor,const in float specularF90,const in float iridescence,const in vec3 iridescenceF0,inout vec3 singleScatter,inout vec3 multiScatter ){
#else
void computeMultiscattering( const in vec2 fab,const in vec3 specularColor,const in float specularF90,inout vec3 singleScatter,inout vec3 multiScatter ){
#endif
#ifdef USE_IRIDESCENCE
vec3 Fr=mix( specularColor,iridescenceF0,iridescence );
#else
vec3 Fr=specularColor;
#endif
vec3 FssEss=Fr*fab.x+specularF90*fab.y;
float Ess=fab.x+fab.y;
float Ems=1. - Ess;
vec3 Favg=Fr+( 1. - Fr )*.047619;
vec3 Fms=FssEss*Favg/( 1. - Ems*Favg );
singleScatter+=FssEss;
multiScatter+=Fms*Ems;
}
#if NUM_RECT_AREA_LIGHTS > 0
void RE_Direct_RectArea_Physical( const in RectAreaLight rectAreaLight,const in vec3 geometryPosition,const in vec3 geometryNormal,const in vec3 geometryViewDir,const in vec3 geometryClearcoatNormal,const in PhysicalMaterial material,inout ReflectedLight reflectedLight ){
vec3 normal=geometryNormal;
vec3 viewDir=geometryViewDir;
vec3 position=geometryPosition;
vec3 lightPos=rectAreaLight.position;
vec3 halfWidth=rectAreaLight.halfWidth;
vec3 halfHeight=rectAreaLight.halfHeight;
vec3 lightColor=rectAreaLight.color;
float roughness=material.roughness;
vec3 rectCoords[ 4 ];
rectCoords[ 0 ]=lightPos+halfWidth - halfHeight;
rectCoords[ 1 ]=lightPos - halfWidth - halfHeight;
rectCoords[ 2 ]=lightPos - halfWidth+halfHeight;
rectCoords[ 3 ]=lightPos+halfWidth+halfHeight;
vec2 uv=LTC_Uv( normal,viewDir,roughness );
vec4 t1=texture2D( ltc_1,uv );
vec4 t2=texture2D( ltc_2,uv );
mat3 mInv=mat3(
vec3( t1.x,0,t1.y ),
vec3(    0,1,   0 ),
vec3( t1.z,0,t1.w )
);
vec3 fresnel=( material.specularColorBlended*t2.x+( material.specularF90 - material.specularColorBlended )*t2.y );
reflectedLight.directSpecular+=lightColor*fresnel*LTC_Evaluate( normal,viewDir,position,mInv,rectCoords );
reflectedLight.directDiffuse+=lightColor*material.diffuseContribution*LTC_Evaluate( normal,viewDir,position,mat3( 1. ),rectCoords );
#ifdef USE_CLEARCOAT
vec3 Ncc=geometryClearcoatNormal;
vec2 uvClearcoat=LTC_Uv( Ncc,viewDir,material.clearcoatRoughness );
vec4 t1Clearcoat=texture2D( ltc_1,uvClearcoat );
vec4 t2Clearcoat=texture2D( ltc_2,uvClearcoat );
mat3 mInvClearcoat=mat3(
vec3( t1Clearcoat.x,0,t1Clearcoat.y ),
vec3(             0,1,            0 ),
vec3( t1Clearcoat.z,0,t1Clearcoat.w )
);
vec3 fresnelClearcoat=material.clearcoatF0*t2Clearcoat.x+( material.clearcoatF90 - material.clearcoatF0 )*t2Clearcoat.y;
clearcoatSpecularDirect+=lightColor*fresnelClearcoat*LTC_Evaluate( Ncc,viewDir,position,mInvClearcoat,rectCoords );
#endif
}
#endif
void RE_Direct_Physical( const in IncidentLight directLight,const in vec3 geometryPosition,const in vec3 geometryNormal,const in vec3 geometryViewDir,const in vec3 geometryClearcoatNormal,const in PhysicalMaterial material,inout ReflectedLight reflectedLight ){
float dotNL=saturate( dot( geometryNormal,directLight.direction ) );
vec3 irradiance=dotNL*directLight.color;
#ifdef USE_CLEARCOAT
float dotNLcc=saturate( dot( geometryClearcoatNormal,directLight.direction ) );
vec3 ccIrradiance=dotNLcc*directLight.color;
clearcoatSpecularDirect+=ccIrradiance*BRDF_GGX_Clearcoat( directLight.direction,geometryViewDir,geometryClearcoatNormal,material );
#endif
#ifdef USE_SHEEN
sheenSpecularDirect+=irradiance*BRDF_Sheen( directLight.direction,geometryViewDir,geometryNormal,material.sheenColor,material.sheenRoughness );
float sheenAlbedoV=IBLSheenBRDF( geometryNormal,geometryViewDir,material.sheenRoughness );
float sheenAlbedoL=IBLSheenBRDF( geometryNormal,directLight.direction,material.sheenRoughness );
float sheenEnergyComp=1. - max3( material.sheenColor )*max( sheenAlbedoV,sheenAlbedoL );
irradiance*=sheenEnergyComp;
#endif
vec3 specularBRDF=BRDF_GGX( directLight.direction,geometryViewDir,geometryNormal,material );
#ifdef USE_RETROREFLECTION
vec3 retroViewDir=reflect( - geometryViewDir,geometryNormal );
vec3 retroSpecularBRDF=BRDF_GGX( directLight.direction,retroViewDir,geometryNormal,material );
specularBRDF=mix( specularBRDF,retroSpecularBRDF,saturate( material.retroreflectivity ) );
#endif
reflectedLight.directSpecular+=irradiance*specularBRDF*material.multiScatteringCompensation;
vec3 halfDir=normalize( directLight.direction+geometryViewDir );
float dotVH=saturate( dot( geometryViewDir,halfDir ) );
vec3 F=F_Schlick( material.specularColor,material.specularF90,dotVH );
#ifdef USE_RETROREFLECTION
vec3 retroHalfDir=normalize( directLight.direction+retroViewDir );
float dotRetroVH=saturate( dot( retroViewDir,retroHalfDir ) );
vec3 retroF=F_Schlick( material.specularColor,material.specularF90,dotRetroVH );
F=mix( F,retroF,saturate( material.retroreflectivity ) );
#endif
#ifdef USE_DIFFUSE_ROUGHNESS
vec3 diffuseBRDF=BRDF_EON( directLight.direction,geometryViewDir,geometryNormal,material.diffuseColor,material.diffuseRoughness )*( 1. - material.metalness );
#else
vec3 diffuseBRDF=BRDF_Lambert( material.diffuseContribution );
#endif
reflectedLight.directDiffuse+=irradiance*diffuseBRDF*( 1. - F );
}
void RE_IndirectDiffuse_Physical( const in vec3 irradiance,const in vec3 geometryPosition,const in vec3 geometryNormal,const in vec3 geometryViewDir,const in vec3 geometryClearcoatNormal,const in PhysicalMaterial material,inout ReflectedLight reflectedLight ){
vec3 singleScattering=vec3( .0 );
vec3 multiScattering=vec3( .0 );
#ifdef USE_IRIDESCENCE
computeMultiscatteringIridescence( material.dfg,material.specularColor,material.specularF90,material.iridescence,material.iridescenceF0Dielectric,singleScattering,multiScattering );
#else
computeMultiscattering( material.dfg,material.specularColor,material.specularF90,singleScattering,multiScattering );
#endif
#ifdef USE_DIFFUSE_ROUGHNESS
float dotNV=saturate( dot( geometryNormal,geometryViewDir ) );
vec3 diffuseAlbedo=EON_DirectionalAlbedo( material.diffuseColor,material.diffuseRoughness,dotNV )*( 1. - material.metalness );
vec3 diffuse=irradiance*RECIPROCAL_PI*diffuseAlbedo*( 1. - singleScattering - multiScattering );
#else
vec3 diffuse=irradiance*BRDF_Lambert( material.diffuseContribution )*( 1. - singleScattering - multiScattering );
#endif
#ifdef USE_SHEEN
float sheenAlbedo=IBLSheenBRDF( geometryNormal,geometryViewDir,material.sheenRoughness );
sheenSpecularIndirect+=irradiance*material.sheenColor*sheenAlbedo*RECIPROCAL_PI;
float sheenEnergyComp=1. - max3( material.sheenColor )*sheenAlbedo;
diffuse*=sheenEnergyComp;
#endif
reflectedLight.indirectDiffuse+=diffuse;
}
void RE_IndirectSpecular_Physical( const in vec3 radiance,const in vec3 irradiance,const in vec3 clearcoatRadiance,const in vec3 geometryPosition,const in vec3 geometryNormal,const in vec3 geometryViewDir,const in vec3 geometryClearcoatNormal,const in PhysicalMaterial material,inout ReflectedLight reflectedLight){
#ifdef USE_CLEARCOAT
clearcoatSpecularIndirect+=clearcoatRadiance*EnvironmentBRDF( geometryClearcoatNormal,geometryViewDir,material.clearcoatF0,material.clearcoatF90,material.clearcoatRoughness );
#endif
#ifdef USE_SHEEN
sheenSpecularIndirect+=irradiance*material.sheenColor*IBLSheenBRDF( geometryNormal,geometryViewDir,material.sheenRoughness )*RECIPROCAL_PI;
#endif
vec3 singleScatteringDielectric=vec3( .0 );
vec3 multiScatteringDielectric=vec3( .0 );
vec3 singleScatteringMetallic=vec3( .0 );
vec3 multiScatteringMetallic=vec3( .0 );
#ifdef USE_IRIDESCENCE
computeMultiscatteringIridescence( material.dfg,material.specularColor,material.specularF90,material.iridescence,material.iridescenceF0Dielectric,singleScatteringDielectric,multiScatteringDielectric );
computeMultiscatteringIridescence( material.dfg,material.diffuseColor,material.specularF90,material.iridescence,material.iridescenceF0Metallic,singleScatteringMetallic,multiScatteringMetallic );
#else
computeMultiscattering( material.dfg,material.specularColor,material.specularF90,singleScatteringDielectric,multiScatteringDielectric );
computeMultiscattering( material.dfg,material.diffuseColor,material.specularF90,singleScatteringMetallic,multiScatteringMetallic );
#endif
vec3 singleScattering=mix( singleScatteringDielectric,singleScatteringMetallic,material.metalness );
vec3 multiScattering=mix( multiScatteringDielectric,multiScatteringMetallic,material.metalness );
vec3 totalScatteringDielectric=singleScatteringDielectric+multiScatteringDielectric;
#ifdef USE_DIFFUSE_ROUGHNESS
float dotNV=saturate( dot( geometryNormal,geometryViewDir ) );
vec3 diffuse=EON_DirectionalAlbedo( material.diffuseColor,material.diffuseRoughness,dotNV )*( 1. - material.metalness )*( 1. - totalScatteringDielectric );
#else
vec3 diffuse=material.diffuseContribution*( 1. - totalScatteringDielectric );
#endif
vec3 cosineWeightedIrradiance=irradiance*RECIPROCAL_PI;
vec3 indirectSpecular=radiance*singleScattering;
indirectSpecular+=multiScattering*cosineWeightedIrradiance;
vec3 indirectDiffuse=diffuse*cosineWeightedIrradiance;
#ifdef USE_SHEEN
float sheenAlbedo=IBLSheenBRDF( geometryNormal,geometryViewDir,material.sheenRoughness );
float sheenEnergyComp=1. - max3( material.sheenColor )*sheenAlbedo;
indirectSpecular*=sheenEnergyComp;
indirectDiffuse*=sheenEnergyComp;
#endif
reflectedLight.indirectSpecular+=indirectSpecular;
reflectedLight.indirectDiffuse+=indirectDiffuse;
}
#define RE_Direct				RE_Direct_Physical
#define RE_Direct_RectArea		RE_Direct_RectArea_Physical
#define RE_IndirectDiffuse		RE_IndirectDiffuse_Physical
#define RE_IndirectSpecular		RE_IndirectSpecular_Physical
float computeSpecularOcclusion( const in float dotNV,const in float ambientOcclusion,const in float roughness ){
return saturate( pow( dotNV+ambientOcclusion,exp2( - 16.*roughness - 1. ) ) - 1.+ambientOcclusion );
}
`,logdepthbuf_fragment:`
#if defined( USE_LOGARITHMIC_DEPTH_BUFFER )
gl_FragDepth=vIsPerspective==.0?gl_FragCoord.z:log2( vFragDepth )*logDepthBufFC*.5;
#endif
`,logdepthbuf_pars_fragment:`
#if defined( USE_LOGARITHMIC_DEPTH_BUFFER )
uniform float logDepthBufFC;
varying float vFragDepth;
varying float vIsPerspective;
#endif
`,logdepthbuf_pars_vertex:`
#ifdef USE_LOGARITHMIC_DEPTH_BUFFER
varying float vFragDepth;
varying float vIsPerspective;
#endif
`,logdepthbuf_vertex:`
#ifdef USE_LOGARITHMIC_DEPTH_BUFFER
vFragDepth=1.+gl_Position.w;
vIsPerspective=float( isPerspectiveMatrix( projectionMatrix ) );
#endif
`,map_fragment:`
#ifdef USE_MAP
vec4 sampledDiffuseColor=texture2D( map,vMapUv );
#ifdef DECODE_VIDEO_TEXTURE
sampledDiffuseColor=sRGBTransferEOTF( sampledDiffuseColor );
#endif
diffuseColor*=sampledDiffuseColor;
#endif
`,map_pars_fragment:`
#ifdef USE_MAP
uniform sampler2D map;
#endif
`,map_particle_fragment:`
#if defined( USE_MAP ) || defined( USE_ALPHAMAP )
#if defined( USE_POINTS_UV )
vec2 uv=vUv;
#else
vec2 uv=( uvTransform*vec3( gl_PointCoord.x,1. - gl_PointCoord.y,1 ) ).xy;
#endif
#endif
#ifdef USE_MAP
diffuseColor*=texture2D( map,uv );
#endif
#ifdef USE_ALPHAMAP
diffuseColor.a*=texture2D( alphaMap,uv ).g;
#endif
`,map_particle_pars_fragment:`
#if defined( USE_POINTS_UV )
varying vec2 vUv;
#else
#if defined( USE_MAP ) || defined( USE_ALPHAMAP )
uniform mat3 uvTransform;
#endif
#endif
#ifdef USE_MAP
uniform sampler2D map;
#endif
#ifdef USE_ALPHAMAP
uniform sampler2D alphaMap;
#endif
`,metalnessmap_fragment:`
float metalnessFactor=metalness;
#ifdef USE_METALNESSMAP
vec4 texelMetalness=texture2D( metalnessMap,vMetalnessMapUv );
metalnessFactor*=texelMetalness.b;
#endif
`,metalnessmap_pars_fragment:`
#ifdef USE_METALNESSMAP
uniform sampler2D metalnessMap;
#endif
`,morphcolor_vertex:`
#if defined( USE_MORPHCOLORS )
#if defined( USE_COLOR_ALPHA )
vColor*=morphTargetBaseInfluence;
#elif defined( USE_COLOR )
vColor.rgb*=morphTargetBaseInfluence;
#endif
for ( int i=0;i<MORPHTARGETS_COUNT;i++){
#if defined( USE_COLOR_ALPHA )
if ( morphTargetInfluences[ i ] !=.0 ) vColor+=getMorph( gl_VertexID,i,2 )*morphTargetInfluences[ i ];
#elif defined( USE_COLOR )
if ( morphTargetInfluences[ i ] !=.0 ) vColor.rgb+=getMorph( gl_VertexID,i,2 ).rgb*morphTargetInfluences[ i ];
#endif
}
#endif
`,morphnormal_vertex:`
#ifdef USE_MORPHNORMALS
objectNormal*=morphTargetBaseInfluence;
for ( int i=0;i<MORPHTARGETS_COUNT;i++){
if ( morphTargetInfluences[ i ] !=.0 ) objectNormal+=getMorph( gl_VertexID,i,1 ).xyz*morphTargetInfluences[ i ];
}
#endif
`,morphtarget_pars_vertex:`
#ifdef USE_MORPHTARGETS
#ifndef USE_INSTANCING_MORPH
uniform float morphTargetBaseInfluence;
uniform float morphTargetInfluences[ MORPHTARGETS_COUNT ];
#endif
uniform sampler2DArray morphTargetsTexture;
uniform ivec2 morphTargetsTextureSize;
vec4 getMorph( const in int vertexIndex,const in int morphTargetIndex,const in int offset ){
int texelIndex=vertexIndex*MORPHTARGETS_TEXTURE_STRIDE+offset;
int y=texelIndex/morphTargetsTextureSize.x;
int x=texelIndex - y*morphTargetsTextureSize.x;
ivec3 morphUV=ivec3( x,y,morphTargetIndex );
return texelFetch( morphTargetsTexture,morphUV,0 );
}
#endif
`,morphtarget_vertex:`
#ifdef USE_MORPHTARGETS
transformed*=morphTargetBaseInfluence;
for ( int i=0;i<MORPHTARGETS_COUNT;i++){
if ( morphTargetInfluences[ i ] !=.0 ) transformed+=getMorph( gl_VertexID,i,0 ).xyz*morphTargetInfluences[ i ];
}
#endif
`,normal_fragment_begin:`
float faceDirection=gl_FrontFacing?1.:- 1.;
#ifdef FLAT_SHADED
vec3 fdx=dFdx( vViewPosition );
vec3 fdy=dFdy( vViewPosition );
vec3 normal=normalize( cross( fdx,fdy ) );
#else
vec3 normal=normalize( vNormal );
#ifdef DOUBLE_SIDED
normal*=faceDirection;
#endif
#endif
#if defined( USE_NORMALMAP_TANGENTSPACE ) || defined( USE_CLEARCOAT_NORMALMAP ) || defined( USE_ANISOTROPY )
#ifdef USE_TANGENT
mat3 tbn=mat3( normalize( vTangent ),normalize( vBitangent ),normal );
#else
mat3 tbn=getTangentFrame( - vViewPosition,normal,
#if defined( USE_NORMALMAP )
vNormalMapUv
#elif defined( USE_CLEARCOAT_NORMALMAP )
vClearcoatNormalMapUv
#else
vUv
#endif
);
#endif
#ifdef DOUBLE_SIDED
tbn[0]*=faceDirection;
tbn[1]*=faceDirection;
#endif
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
#ifdef USE_TANGENT
mat3 tbn2=mat3( normalize( vTangent ),normalize( vBitangent ),normal );
#else
mat3 tbn2=getTangentFrame( - vViewPosition,normal,vClearcoatNormalMapUv );
#endif
#ifdef DOUBLE_SIDED
tbn2[0]*=faceDirection;
tbn2[1]*=faceDirection;
#endif
#endif
vec3 nonPerturbedNormal=normal;
`,normal_fragment_maps:`
#ifdef USE_NORMALMAP_OBJECTSPACE
normal=texture2D( normalMap,vNormalMapUv ).xyz*2. - 1.;
#ifdef FLIP_SIDED
normal=- normal;
#endif
#ifdef DOUBLE_SIDED
normal=normal*faceDirection;
#endif
normal=normalize( normalMatrix*normal );
#elif defined( USE_NORMALMAP_TANGENTSPACE )
vec3 mapN=texture2D( normalMap,vNormalMapUv ).xyz*2. - 1.;
#if defined( USE_PACKED_NORMALMAP )
mapN=vec3( mapN.xy,sqrt( saturate( 1. - dot( mapN.xy,mapN.xy ) ) ) );
#endif
mapN.xy*=normalScale;
normal=normalize( tbn*mapN );
#elif defined( USE_BUMPMAP )
normal=perturbNormalArb( - vViewPosition,normal,dHdxy_fwd(),faceDirection );
#endif
`,normalmap_pars_fragment:`
#ifdef USE_NORMALMAP
uniform sampler2D normalMap;
uniform vec2 normalScale;
#endif
#ifdef USE_NORMALMAP_OBJECTSPACE
uniform mat3 normalMatrix;
#endif
#if ! defined ( USE_TANGENT ) && ( defined ( USE_NORMALMAP_TANGENTSPACE ) || defined ( USE_CLEARCOAT_NORMALMAP ) || defined( USE_ANISOTROPY ) )
mat3 getTangentFrame( vec3 eye_pos,vec3 surf_norm,vec2 uv ){
vec3 q0=dFdx( eye_pos.xyz );
vec3 q1=dFdy( eye_pos.xyz );
vec2 st0=dFdx( uv.st );
vec2 st1=dFdy( uv.st );
vec3 N=surf_norm;
vec3 q1perp=cross( q1,N );
vec3 q0perp=cross( N,q0 );
vec3 T=q1perp*st0.x+q0perp*st1.x;
vec3 B=q1perp*st0.y+q0perp*st1.y;
float det=max( dot( T,T ),dot( B,B ) );
float scale=( det==.0 )?.0:inversesqrt( det );
return mat3( T*scale,B*scale,N );
}
#endif
`,opaque_fragment:`
#ifdef OPAQUE
diffuseColor.a=1.;
#endif
#ifdef USE_TRANSMISSION
diffuseColor.a*=material.transmissionAlpha;
#endif
gl_FragColor=vec4( outgoingLight,diffuseColor.a );
`,packing:`
vec3 packNormalToRGB( const in vec3 normal ){
return normalize( normal )*.5+.5;
}
vec3 unpackRGBToNormal( const in vec3 rgb ){
return 2.*rgb.xyz - 1.;
}
const float PackUpscale=256./255.;
const float UnpackDownscale=255./256.;
const float ShiftRight8=1./256.;
const float Inv255=1./255.;
const vec4 PackFactors=vec4( 1.,256.,256.*256.,256.*256.*256. );
const vec2 UnpackFactors2=vec2( UnpackDownscale,1./PackFactors.g );
const vec3 UnpackFactors3=vec3( UnpackDownscale/PackFactors.rg,1./PackFactors.b );
const vec4 UnpackFactors4=vec4( UnpackDownscale/PackFactors.rgb,1./PackFactors.a );
vec4 packDepthToRGBA( const in float v ){
if( v<=.0 )
return vec4( 0.,0.,0.,0. );
if( v>=1. )
return vec4( 1.,1.,1.,1. );
float vuf;
float af=modf( v*PackFactors.a,vuf );
float bf=modf( vuf*ShiftRight8,vuf );
float gf=modf( vuf*ShiftRight8,vuf );
return vec4( vuf*Inv255,gf*PackUpscale,bf*PackUpscale,af );
}
vec3 packDepthToRGB( const in float v ){
if( v<=.0 )
return vec3( 0.,0.,0. );
if( v>=1. )
return vec3( 1.,1.,1. );
float vuf;
float bf=modf( v*PackFactors.b,vuf );
float gf=modf( vuf*ShiftRight8,vuf );
return vec3( vuf*Inv255,gf*PackUpscale,bf );
}
vec2 packDepthToRG( const in float v ){
if( v<=.0 )
return vec2( 0.,0. );
if( v>=1. )
return vec2( 1.,1. );
float vuf;
float gf=modf( v*256.,vuf );
return vec2( vuf*Inv255,gf );
}
float unpackRGBAToDepth( const in vec4 v ){
return dot( v,UnpackFactors4 );
}
float unpackRGBToDepth( const in vec3 v ){
return dot( v,UnpackFactors3 );
}
float unpackRGToDepth( const in vec2 v ){
return v.r*UnpackFactors2.r+v.g*UnpackFactors2.g;
}
vec4 pack2HalfToRGBA( const in vec2 v ){
vec4 r=vec4( v.x,fract( v.x*255. ),v.y,fract( v.y*255. ) );
return vec4( r.x - r.y/255.,r.y,r.z - r.w/255.,r.w );
}
vec2 unpackRGBATo2Half( const in vec4 v ){
return vec2( v.x+( v.y/255. ),v.z+( v.w/255. ) );
}
float viewZToOrthographicDepth( const in float viewZ,const in float near,const in float far ){
return ( viewZ+near )/( near - far );
}
float orthographicDepthToViewZ( const in float depth,const in float near,const in float far ){
#ifdef USE_REVERSED_DEPTH_BUFFER
return depth*( far - near ) - far;
#else
return depth*( near - far ) - near;
#endif
}
float viewZToPerspectiveDepth( const in float viewZ,const in float near,const in float far ){
return ( ( near+viewZ )*far )/( ( far - near )*viewZ );
}
float perspectiveDepthToViewZ( const in float depth,const in float near,const in float far ){
#ifdef USE_REVERSED_DEPTH_BUFFER
return ( near*far )/( ( near - far )*depth - near );
#else
return ( near*far )/( ( far - near )*depth - far );
#endif
}
`,premultiplied_alpha_fragment:`
#ifdef PREMULTIPLIED_ALPHA
gl_FragColor.rgb*=gl_FragColor.a;
#endif
`,project_vertex:`
vec4 mvPosition=vec4( transformed,1. );
#ifdef USE_BATCHING
mvPosition=batchingMatrix*mvPosition;
#endif
#ifdef USE_INSTANCING
mvPosition=instanceMatrix*mvPosition;
#endif
mvPosition=modelViewMatrix*mvPosition;
gl_Position=projectionMatrix*mvPosition;
`,roughnessmap_fragment:`
float roughnessFactor=roughness;
#ifdef USE_ROUGHNESSMAP
vec4 texelRoughness=texture2D( roughnessMap,vRoughnessMapUv );
roughnessFactor*=texelRoughness.g;
#endif
`,roughnessmap_pars_fragment:`
#ifdef USE_ROUGHNESSMAP
uniform sampler2D roughnessMap;
#endif
`,shadowmap_pars_fragment:`
#if NUM_SPOT_LIGHT_COORDS > 0
varying vec4 vSpotLightCoord[ NUM_SPOT_LIGHT_COORDS ];
#endif
#if NUM_SPOT_LIGHT_MAPS > 0
uniform sampler2D spotLightMap[ NUM_SPOT_LIGHT_MAPS ];
#endif
#ifdef USE_SHADOWMAP
#if NUM_SUN_LIGHT_SHADOWS > 0
#define SUN_LIGHT_CASCADES 2
#if defined( SHADOWMAP_TYPE_PCF )
uniform sampler2DShadow sunShadowMap[ NUM_SUN_LIGHT_SHADOWS ];
#else
uniform sampler2D sunShadowMap[ NUM_SUN_LIGHT_SHADOWS ];
#endif
uniform mat4 sunShadowMatrix[ NUM_SUN_LIGHT_SHADOWS*SUN_LIGHT_CASCADES ];
uniform vec4 sunShadowCascade[ NUM_SUN_LIGHT_SHADOWS*SUN_LIGHT_CASCADES ];
varying vec4 vSunShadowWorldPosition;
varying vec3 vSunShadowWorldNormal;
struct SunLightShadow{
float shadowIntensity;
float shadowBias;
float shadowNormalBias;
float shadowRadius;
vec2 shadowMapSize;
};
uniform SunLightShadow sunLightShadows[ NUM_SUN_LIGHT_SHADOWS ];
#endif
#if NUM_DIR_LIGHT_SHADOWS > 0
#if defined( SHADOWMAP_TYPE_PCF )
uniform sampler2DShadow directionalShadowMap[ NUM_DIR_LIGHT_SHADOWS ];
#else
uniform sampler2D directionalShadowMap[ NUM_DIR_LIGHT_SHADOWS ];
#endif
varying vec4 vDirectionalShadowCoord[ NUM_DIR_LIGHT_SHADOWS ];
struct DirectionalLightShadow{
float shadowIntensity;
float shadowBias;
float shadowNormalBias;
float shadowRadius;
vec2 shadowMapSize;
};
uniform DirectionalLightShadow directionalLightShadows[ NUM_DIR_LIGHT_SHADOWS ];
#endif
#if NUM_SPOT_LIGHT_SHADOWS > 0
#if defined( SHADOWMAP_TYPE_PCF )
uniform sampler2DShadow spotShadowMap[ NUM_SPOT_LIGHT_SHADOWS ];
#else
uniform sampler2D spotShadowMap[ NUM_SPOT_LIGHT_SHADOWS ];
#endif
struct SpotLightShadow{
float shadowIntensity;
float shadowBias;
float shadowNormalBias;
float shadowRadius;
vec2 shadowMapSize;
};
uniform SpotLightShadow spotLightShadows[ NUM_SPOT_LIGHT_SHADOWS ];
#endif
#if NUM_POINT_LIGHT_SHADOWS > 0
#if defined( SHADOWMAP_TYPE_PCF )
uniform samplerCubeShadow pointShadowMap[ NUM_POINT_LIGHT_SHADOWS ];
#elif defined( SHADOWMAP_TYPE_BASIC )
uniform samplerCube pointShadowMap[ NUM_POINT_LIGHT_SHADOWS ];
#endif
varying vec4 vPointShadowCoord[ NUM_POINT_LIGHT_SHADOWS ];
struct PointLightShadow{
float shadowIntensity;
float shadowBias;
float shadowNormalBias;
float shadowRadius;
vec2 shadowMapSize;
float shadowCameraNear;
float shadowCameraFar;
};
uniform PointLightShadow pointLightShadows[ NUM_POINT_LIGHT_SHADOWS ];
#endif
#if defined( SHADOWMAP_TYPE_PCF )
float interleavedGradientNoise( vec2 position ){
return fract( 52.9829189*fract( dot( position,vec2( .06711056,.00583715 ) ) ) );
}
vec2 vogelDiskSample( int sampleIndex,int samplesCount,float phi ){
const float goldenAngle=2.399963229728653;
float r=sqrt( ( float( sampleIndex )+.5 )/float( samplesCount ) );
float theta=float( sampleIndex )*goldenAngle+phi;
return vec2( cos( theta ),sin( theta ) )*r;
}
#endif
#if defined( SHADOWMAP_TYPE_PCF )
float getShadow( sampler2DShadow shadowMap,vec2 shadowMapSize,float shadowIntensity,float shadowBias,float shadowRadius,vec4 shadowCoord ){
float shadow=1.;
shadowCoord.xyz/=shadowCoord.w;
#ifdef USE_REVERSED_DEPTH_BUFFER
shadowCoord.z -=shadowBias;
#else
shadowCoord.z+=shadowBias;
#endif
bool inFrustum=shadowCoord.x>=.0 && shadowCoord.x<=1. && shadowCoord.y>=.0 && shadowCoord.y<=1.;
bool frustumTest=inFrustum && shadowCoord.z<=1.;
if ( frustumTest ){
vec2 texelSize=vec2( 1. )/shadowMapSize;
vec2 radius=shadowRadius*texelSize;
float phi=interleavedGradientNoise( gl_FragCoord.xy )*PI2;
shadow=(
texture( shadowMap,vec3( shadowCoord.xy+vogelDiskSample( 0,5,phi )*radius,shadowCoord.z ) )+
texture( shadowMap,vec3( shadowCoord.xy+vogelDiskSample( 1,5,phi )*radius,shadowCoord.z ) )+
texture( shadowMap,vec3( shadowCoord.xy+vogelDiskSample( 2,5,phi )*radius,shadowCoord.z ) )+
texture( shadowMap,vec3( shadowCoord.xy+vogelDiskSample( 3,5,phi )*radius,shadowCoord.z ) )+
texture( shadowMap,vec3( shadowCoord.xy+vogelDiskSample( 4,5,phi )*radius,shadowCoord.z ) )
)*.2;
}
return mix( 1.,shadow,shadowIntensity );
}
#elif defined( SHADOWMAP_TYPE_VSM )
float getShadow( sampler2D shadowMap,vec2 shadowMapSize,float shadowIntensity,float shadowBias,float shadowRadius,vec4 shadowCoord ){
float shadow=1.;
shadowCoord.xyz/=shadowCoord.w;
#ifdef USE_REVERSED_DEPTH_BUFFER
shadowCoord.z -=shadowBias;
#else
shadowCoord.z+=shadowBias;
#endif
bool inFrustum=shadowCoord.x>=.0 && shadowCoord.x<=1. && shadowCoord.y>=.0 && shadowCoord.y<=1.;
bool frustumTest=inFrustum && shadowCoord.z<=1.;
if ( frustumTest ){
vec2 distribution=texture2D( shadowMap,shadowCoord.xy ).rg;
float mean=distribution.x;
float variance=distribution.y*distribution.y;
#ifdef USE_REVERSED_DEPTH_BUFFER
float hard_shadow=step( mean,shadowCoord.z );
#else
float hard_shadow=step( shadowCoord.z,mean );
#endif
if ( hard_shadow==1. ){
shadow=1.;
}else{
variance=max( variance,.0000001 );
float d=shadowCoord.z - mean;
float p_max=variance/( variance+d*d );
p_max=clamp( ( p_max - .3 )/.65,.0,1. );
shadow=max( hard_shadow,p_max );
}
}
return mix( 1.,shadow,shadowIntensity );
}
#else
float getShadow( sampler2D shadowMap,vec2 shadowMapSize,float shadowIntensity,float shadowBias,float shadowRadius,vec4 shadowCoord ){
float shadow=1.;
shadowCoord.xyz/=shadowCoord.w;
#ifdef USE_REVERSED_DEPTH_BUFFER
shadowCoord.z -=shadowBias;
#else
shadowCoord.z+=shadowBias;
#endif
bool inFrustum=shadowCoord.x>=.0 && shadowCoord.x<=1. && shadowCoord.y>=.0 && shadowCoord.y<=1.;
bool frustumTest=inFrustum && shadowCoord.z<=1.;
if ( frustumTest ){
float depth=texture2D( shadowMap,shadowCoord.xy ).r;
#ifdef USE_REVERSED_DEPTH_BUFFER
shadow=step( depth,shadowCoord.z );
#else
shadow=step( shadowCoord.z,depth );
#endif
}
return mix( 1.,shadow,shadowIntensity );
}
#endif
#if NUM_SUN_LIGHT_SHADOWS > 0
float getSunShadow(
#if defined( SHADOWMAP_TYPE_PCF )
sampler2DShadow shadowMap,
#else
sampler2D shadowMap,
#endif
SunLightShadow sunLightShadow,
int shadowIndex
){
vec4 shadowWorldPosition=vec4( vSunShadowWorldPosition.xyz+vSunShadowWorldNormal*sunLightShadow.shadowNormalBias,1. );
float viewDepth=vSunShadowWorldPosition.w;
int cascadeOffset=shadowIndex*SUN_LIGHT_CASCADES;
float shadow=1.;
for ( int i=SUN_LIGHT_CASCADES - 1;i>=0;i -- ){
vec4 cascade=sunShadowCascade[ cascadeOffset+i ];
if ( viewDepth>=cascade.x && viewDepth<cascade.y ){
float cascadeShadow=getShadow(
shadowMap,
sunLightShadow.shadowMapSize,
sunLightShadow.shadowIntensity,
sunLightShadow.shadowBias,
sunLightShadow.shadowRadius,
sunShadowMatrix[ cascadeOffset+i ]*shadowWorldPosition
);
shadow=mix( cascadeShadow,shadow,smoothstep( cascade.z,cascade.y,viewDepth ) );
}
}
return shadow;
}
#endif
#if NUM_POINT_LIGHT_SHADOWS > 0
#if defined( SHADOWMAP_TYPE_PCF )
float getPointShadow( samplerCubeShadow shadowMap,vec2 shadowMapSize,float shadowIntensity,float shadowBias,float shadowRadius,vec4 shadowCoord,float shadowCameraNear,float shadowCameraFar ){
float shadow=1.;
vec3 lightToPosition=shadowCoord.xyz;
vec3 bd3D=normalize( lightToPosition );
vec3 absVec=abs( lightToPosition );
float viewSpaceZ=max( max( absVec.x,absVec.y ),absVec.z );
if ( viewSpaceZ - shadowCameraFar<=.0 && viewSpaceZ - shadowCameraNear>=.0 ){
float lightDistance=length( lightToPosition );
float depthRange=shadowCameraFar - shadowCameraNear;
#ifdef USE_REVERSED_DEPTH_BUFFER
float depthA=- shadowCameraNear/depthRange - shadowBias;
float depthB=shadowCameraNear*shadowCameraFar/( depthRange*lightDistance );
#else
float depthA=shadowCameraFar/depthRange+shadowBias;
float depthB=- shadowCameraNear*shadowCameraFar/( depthRange*lightDistance );
#endif
float texelSize=shadowRadius/shadowMapSize.x;
vec3 absDir=abs( bd3D );
vec3 tangent=absDir.x>absDir.z?vec3( .0,1.,.0 ):vec3( 1.,.0,.0 );
tangent=normalize( cross( bd3D,tangent ) );
vec3 bitangent=cross( bd3D,tangent );
float phi=interleavedGradientNoise( gl_FragCoord.xy )*PI2;
shadow=.0;
for ( int i=0;i<5;i++){
vec2 offset=vogelDiskSample( i,5,phi );
vec3 direction=bd3D+( tangent*offset.x+bitangent*offset.y )*texelSize;
vec3 absDirection=abs( direction );
float dp=depthA+depthB/max( max( absDirection.x,absDirection.y ),absDirection.z );
shadow+=texture( shadowMap,vec4( direction,dp ) );
}
shadow*=.2;
}
return mix( 1.,shadow,shadowIntensity );
}
#elif defined( SHADOWMAP_TYPE_BASIC )
float getPointShadow( samplerCube shadowMap,vec2 shadowMapSize,float shadowIntensity,float shadowBias,float shadowRadius,vec4 shadowCoord,float shadowCameraNear,float shadowCameraFar ){
float shadow=1.;
vec3 lightToPosition=shadowCoord.xyz;
vec3 absVec=abs( lightToPosition );
float viewSpaceZ=max( max( absVec.x,absVec.y ),absVec.z );
if ( viewSpaceZ - shadowCameraFar<=.0 && viewSpaceZ - shadowCameraNear>=.0 ){
float dp=( shadowCameraFar*( viewSpaceZ - shadowCameraNear ) )/( viewSpaceZ*( shadowCameraFar - shadowCameraNear ) );
dp+=shadowBias;
vec3 bd3D=normalize( lightToPosition );
float depth=textureCube( shadowMap,bd3D ).r;
#ifdef USE_REVERSED_DEPTH_BUFFER
depth=1. - depth;
#endif
shadow=step( dp,depth );
}
return mix( 1.,shadow,shadowIntensity );
}
#endif
#endif
#endif
`,shadowmap_pars_vertex:`
#if NUM_SPOT_LIGHT_COORDS > 0
uniform mat4 spotLightMatrix[ NUM_SPOT_LIGHT_COORDS ];
varying vec4 vSpotLightCoord[ NUM_SPOT_LIGHT_COORDS ];
#endif
#ifdef USE_SHADOWMAP
#if NUM_SUN_LIGHT_SHADOWS > 0
varying vec4 vSunShadowWorldPosition;
varying vec3 vSunShadowWorldNormal;
#endif
#if NUM_DIR_LIGHT_SHADOWS > 0
uniform mat4 directionalShadowMatrix[ NUM_DIR_LIGHT_SHADOWS ];
varying vec4 vDirectionalShadowCoord[ NUM_DIR_LIGHT_SHADOWS ];
struct DirectionalLightShadow{
float shadowIntensity;
float shadowBias;
float shadowNormalBias;
float shadowRadius;
vec2 shadowMapSize;
};
uniform DirectionalLightShadow directionalLightShadows[ NUM_DIR_LIGHT_SHADOWS ];
#endif
#if NUM_SPOT_LIGHT_SHADOWS > 0
struct SpotLightShadow{
float shadowIntensity;
float shadowBias;
float shadowNormalBias;
float shadowRadius;
vec2 shadowMapSize;
};
uniform SpotLightShadow spotLightShadows[ NUM_SPOT_LIGHT_SHADOWS ];
#endif
#if NUM_POINT_LIGHT_SHADOWS > 0
uniform mat4 pointShadowMatrix[ NUM_POINT_LIGHT_SHADOWS ];
varying vec4 vPointShadowCoord[ NUM_POINT_LIGHT_SHADOWS ];
struct PointLightShadow{
float shadowIntensity;
float shadowBias;
float shadowNormalBias;
float shadowRadius;
vec2 shadowMapSize;
float shadowCameraNear;
float shadowCameraFar;
};
uniform PointLightShadow pointLightShadows[ NUM_POINT_LIGHT_SHADOWS ];
#endif
/*
#if NUM_RECT_AREA_LIGHTS > 0
#endif
*/
#endif
`,shadowmap_vertex:`
#if ( defined( USE_SHADOWMAP ) && ( NUM_DIR_LIGHT_SHADOWS > 0 || NUM_SUN_LIGHT_SHADOWS > 0 || NUM_POINT_LIGHT_SHADOWS > 0 ) ) || ( NUM_SPOT_LIGHT_COORDS > 0 )
#ifdef HAS_NORMAL
vec3 shadowWorldNormal=transformNormalByInverseViewMatrix( transformedNormal,viewMatrix );
#else
vec3 shadowWorldNormal=vec3( .0 );
#endif
vec4 shadowWorldPosition;
#endif
#if defined( USE_SHADOWMAP )
#if NUM_SUN_LIGHT_SHADOWS > 0
vSunShadowWorldPosition=vec4( worldPosition.xyz,- mvPosition.z );
vSunShadowWorldNormal=shadowWorldNormal;
#endif
#if NUM_DIR_LIGHT_SHADOWS > 0
#pragma unroll_loop_start
for ( int i=0;i<NUM_DIR_LIGHT_SHADOWS;i++){
shadowWorldPosition=worldPosition+vec4( shadowWorldNormal*directionalLightShadows[ i ].shadowNormalBias,0 );
vDirectionalShadowCoord[ i ]=directionalShadowMatrix[ i ]*shadowWorldPosition;
}
#pragma unroll_loop_end
#endif
#if NUM_POINT_LIGHT_SHADOWS > 0
#pragma unroll_loop_start
for ( int i=0;i<NUM_POINT_LIGHT_SHADOWS;i++){
shadowWorldPosition=worldPosition+vec4( shadowWorldNormal*pointLightShadows[ i ].shadowNormalBias,0 );
vPointShadowCoord[ i ]=pointShadowMatrix[ i ]*shadowWorldPosition;
}
#pragma unroll_loop_end
#endif
/*
#if NUM_RECT_AREA_LIGHTS > 0
#endif
*/
#endif
#if NUM_SPOT_LIGHT_COORDS > 0
#pragma unroll_loop_start
for ( int i=0;i<NUM_SPOT_LIGHT_COORDS;i++){
shadowWorldPosition=worldPosition;
#if ( defined( USE_SHADOWMAP ) && UNROLLED_LOOP_INDEX < NUM_SPOT_LIGHT_SHADOWS )
shadowWorldPosition.xyz+=shadowWorldNormal*spotLightShadows[ i ].shadowNormalBias;
#endif
vSpotLightCoord[ i ]=spotLightMatrix[ i ]*shadowWorldPosition;
}
#pragma unroll_loop_end
#endif
`,shadowmask_pars_fragment:`
float getShadowMask(){
float shadow=1.;
#ifdef USE_SHADOWMAP
#if NUM_SUN_LIGHT_SHADOWS > 0
SunLightShadow sunLight;
#pragma unroll_loop_start
for ( int i=0;i<NUM_SUN_LIGHT_SHADOWS;i++){
sunLight=sunLightShadows[ i ];
shadow*=receiveShadow?getSunShadow( sunShadowMap[ i ],sunLight,UNROLLED_LOOP_INDEX ):1.;
}
#pragma unroll_loop_end
#endif
#if NUM_DIR_LIGHT_SHADOWS > 0
DirectionalLightShadow directionalLight;
#pragma unroll_loop_start
for ( int i=0;i<NUM_DIR_LIGHT_SHADOWS;i++){
directionalLight=directionalLightShadows[ i ];
shadow*=receiveShadow?getShadow( directionalShadowMap[ i ],directionalLight.shadowMapSize,directionalLight.shadowIntensity,directionalLight.shadowBias,directionalLight.shadowRadius,vDirectionalShadowCoord[ i ] ):1.;
}
#pragma unroll_loop_end
#endif
#if NUM_SPOT_LIGHT_SHADOWS > 0
SpotLightShadow spotLight;
#pragma unroll_loop_start
for ( int i=0;i<NUM_SPOT_LIGHT_SHADOWS;i++){
spotLight=spotLightShadows[ i ];
shadow*=receiveShadow?getShadow( spotShadowMap[ i ],spotLight.shadowMapSize,spotLight.shadowIntensity,spotLight.shadowBias,spotLight.shadowRadius,vSpotLightCoord[ i ] ):1.;
}
#pragma unroll_loop_end
#endif
#if NUM_POINT_LIGHT_SHADOWS > 0 && ( defined( SHADOWMAP_TYPE_PCF ) || defined( SHADOWMAP_TYPE_BASIC ) )
PointLightShadow pointLight;
#pragma unroll_loop_start
for ( int i=0;i<NUM_POINT_LIGHT_SHADOWS;i++){
pointLight=pointLightShadows[ i ];
shadow*=receiveShadow?getPointShadow( pointShadowMap[ i ],pointLight.shadowMapSize,pointLight.shadowIntensity,pointLight.shadowBias,pointLight.shadowRadius,vPointShadowCoord[ i ],pointLight.shadowCameraNear,pointLight.shadowCameraFar ):1.;
}
#pragma unroll_loop_end
#endif
/*
#if NUM_RECT_AREA_LIGHTS > 0
#endif
*/
#endif
return shadow;
}
`,skinbase_vertex:`
#ifdef USE_SKINNING
mat4 boneMatX=getBoneMatrix( skinIndex.x );
mat4 boneMatY=getBoneMatrix( skinIndex.y );
mat4 boneMatZ=getBoneMatrix( skinIndex.z );
mat4 boneMatW=getBoneMatrix( skinIndex.w );
#endif
`,skinning_pars_vertex:`
#ifdef USE_SKINNING
uniform mat4 bindMatrix;
uniform mat4 bindMatrixInverse;
uniform highp sampler2D boneTexture;
mat4 getBoneMatrix( const in float i ){
int size=textureSize( boneTexture,0 ).x;
int j=int( i )*4;
int x=j % size;
int y=j/size;
vec4 v1=texelFetch( boneTexture,ivec2( x,y ),0 );
vec4 v2=texelFetch( boneTexture,ivec2( x+1,y ),0 );
vec4 v3=texelFetch( boneTexture,ivec2( x+2,y ),0 );
vec4 v4=texelFetch( boneTexture,ivec2( x+3,y ),0 );
return mat4( v1,v2,v3,v4 );
}
#endif
`,skinning_vertex:`
#ifdef USE_SKINNING
vec4 skinVertex=bindMatrix*vec4( transformed,1. );
vec4 skinned=vec4( .0 );
skinned+=boneMatX*skinVertex*skinWeight.x;
skinned+=boneMatY*skinVertex*skinWeight.y;
skinned+=boneMatZ*skinVertex*skinWeight.z;
skinned+=boneMatW*skinVertex*skinWeight.w;
transformed=( bindMatrixInverse*skinned ).xyz;
#endif
`,skinnormal_vertex:`
#ifdef USE_SKINNING
mat4 skinMatrix=mat4( .0 );
skinMatrix+=skinWeight.x*boneMatX;
skinMatrix+=skinWeight.y*boneMatY;
skinMatrix+=skinWeight.z*boneMatZ;
skinMatrix+=skinWeight.w*boneMatW;
skinMatrix=bindMatrixInverse*skinMatrix*bindMatrix;
objectNormal=vec4( skinMatrix*vec4( objectNormal,.0 ) ).xyz;
#ifdef USE_TANGENT
objectTangent=vec4( skinMatrix*vec4( objectTangent,.0 ) ).xyz;
#endif
#endif
`,specularmap_fragment:`
float specularStrength;
#ifdef USE_SPECULARMAP
vec4 texelSpecular=texture2D( specularMap,vSpecularMapUv );
specularStrength=texelSpecular.r;
#else
specularStrength=1.;
#endif
`,specularmap_pars_fragment:`
#ifdef USE_SPECULARMAP
uniform sampler2D specularMap;
#endif
`,tonemapping_pars_fragment:`
#ifndef saturate
#define saturate( a ) clamp( a, 0.0, 1.0 )
#endif
uniform float toneMappingExposure;
vec3 LinearToneMapping( vec3 color ){
return saturate( toneMappingExposure*color );
}
vec3 ReinhardToneMapping( vec3 color ){
color*=toneMappingExposure;
return saturate( color/( vec3( 1. )+color ) );
}
vec3 CineonToneMapping( vec3 color ){
color*=toneMappingExposure;
color=max( vec3( .0 ),color - .004 );
return pow( ( color*( 6.2*color+.5 ) )/( color*( 6.2*color+1.7 )+.06 ),vec3( 2.2 ) );
}
vec3 RRTAndODTFit( vec3 v ){
vec3 a=v*( v+.0245786 ) - .000090537;
vec3 b=v*( .983729*v+.4329510 )+.238081;
return a/b;
}
vec3 ACESFilmicToneMapping( vec3 color ){
const mat3 ACESInputMat=mat3(
vec3( .59719,.07600,.02840 ),
vec3( .35458,.90834,.13383 ),
vec3( .04823,.01566,.83777 )
);
const mat3 ACESOutputMat=mat3(
vec3(  1.60475,-.10208,-.00327 ),
vec3( -.53108, 1.10813,-.07276 ),
vec3( -.07367,-.00605, 1.07602 )
);
color*=toneMappingExposure/.6;
color=ACESInputMat*color;
color=RRTAndODTFit( color );
color=ACESOutputMat*color;
return saturate( color );
}
const mat3 LINEAR_REC2020_TO_LINEAR_SRGB=mat3(
vec3( 1.6605,- .1246,- .0182 ),
vec3( - .5876,1.1329,- .1006 ),
vec3( - .0728,- .0083,1.1187 )
);
const mat3 LINEAR_SRGB_TO_LINEAR_REC2020=mat3(
vec3( .6274,.0691,.0164 ),
vec3( .3293,.9195,.0880 ),
vec3( .0433,.0113,.8956 )
);
vec3 agxDefaultContrastApprox( vec3 x ){
vec3 x2=x*x;
vec3 x4=x2*x2;
return+15.5*x4*x2
- 40.14*x4*x
+31.96*x4
- 6.868*x2*x
+.4298*x2
+.1191*x
- .00232;
}
vec3 AgXToneMapping( vec3 color ){
const mat3 AgXInsetMatrix=mat3(
vec3( .856627153315983,.137318972929847,.11189821299995 ),
vec3( .0951212405381588,.761241990602591,.0767994186031903 ),
vec3( .0482516061458583,.101439036467562,.811302368396859 )
);
const mat3 AgXOutsetMatrix=mat3(
vec3( 1.1271005818144368,- .1413297634984383,- .14132976349843826 ),
vec3( - .11060664309660323,1.157823702216272,- .11060664309660294 ),
vec3( - .016493938717834573,- .016493938717834257,1.2519364065950405 )
);
const float AgxMinEv=- 12.47393;
const float AgxMaxEv=4.026069;
color*=toneMappingExposure;
color=LINEAR_SRGB_TO_LINEAR_REC2020*color;
color=AgXInsetMatrix*color;
color=max( color,1e-10 );
color=log2( color );
color=( color - AgxMinEv )/( AgxMaxEv - AgxMinEv );
color=clamp( color,.0,1. );
color=agxDefaultContrastApprox( color );
color=AgXOutsetMatrix*color;
color=pow( max( vec3( .0 ),color ),vec3( 2.2 ) );
color=LINEAR_REC2020_TO_LINEAR_SRGB*color;
color=clamp( color,.0,1. );
return color;
}
vec3 NeutralToneMapping( vec3 color ){
const float StartCompression=.8 - .04;
const float Desaturation=.15;
color*=toneMappingExposure;
float x=min( color.r,min( color.g,color.b ) );
float offset=x<.08?x - 6.25*x*x:.04;
color -=offset;
float peak=max( color.r,max( color.g,color.b ) );
if ( peak<StartCompression ) return color;
float d=1. - StartCompression;
float newPeak=1. - d*d/( peak+d - StartCompression );
color*=newPeak/peak;
float g=1. - 1./( Desaturation*( peak - newPeak )+1. );
return mix( color,vec3( newPeak ),g );
}
vec3 CustomToneMapping( vec3 color ){return color;}
`,transmission_fragment:`
#ifdef USE_TRANSMISSION
material.transmission=transmission;
material.transmissionAlpha=1.;
material.thickness=thickness;
material.attenuationDistance=attenuationDistance;
material.attenuationColor=attenuationColor;
#ifdef USE_TRANSMISSIONMAP
material.transmission*=texture2D( transmissionMap,vTransmissionMapUv ).r;
#endif
#ifdef USE_THICKNESSMAP
material.thickness*=texture2D( thicknessMap,vThicknessMapUv ).g;
#endif
vec3 pos=vWorldPosition;
vec3 v=normalize( cameraPosition - pos );
vec3 n=transformNormalByInverseViewMatrix( normal,viewMatrix );
vec4 transmitted=getIBLVolumeRefraction(
n,v,material.roughness,material.diffuseContribution,material.specularColorBlended,material.specularF90,
pos,modelMatrix,viewMatrix,projectionMatrix,material.dispersion,material.ior,material.thickness,
material.attenuationColor,material.attenuationDistance );
material.transmissionAlpha=mix( material.transmissionAlpha,transmitted.a,material.transmission );
totalDiffuse=mix( totalDiffuse,transmitted.rgb,material.transmission );
#endif
`,transmission_pars_fragment:`
#ifdef USE_TRANSMISSION
uniform float transmission;
uniform float thickness;
uniform float attenuationDistance;
uniform vec3 attenuationColor;
#ifdef USE_TRANSMISSIONMAP
uniform sampler2D transmissionMap;
#endif
#ifdef USE_THICKNESSMAP
uniform sampler2D thicknessMap;
#endif
uniform vec2 transmissionSamplerSize;
uniform sampler2D transmissionSamplerMap;
uniform mat4 modelMatrix;
uniform mat4 projectionMatrix;
varying vec3 vWorldPosition;
float w0( float a ){
return ( 1./6. )*( a*( a*( - a+3. ) - 3. )+1. );
}
float w1( float a ){
return ( 1./6. )*( a* a*( 3.*a - 6. )+4. );
}
float w2( float a ){
return ( 1./6. )*( a*( a*( - 3.*a+3. )+3. )+1. );
}
float w3( float a ){
return ( 1./6. )*( a*a*a );
}
float g0( float a ){
return w0( a )+w1( a );
}
float g1( float a ){
return w2( a )+w3( a );
}
float h0( float a ){
return - 1.+w1( a )/( w0( a )+w1( a ) );
}
float h1( float a ){
return 1.+w3( a )/( w2( a )+w3( a ) );
}
vec4 bicubic( sampler2D tex,vec2 uv,vec4 texelSize,float lod ){
uv=uv*texelSize.zw+.5;
vec2 iuv=floor( uv );
vec2 fuv=fract( uv );
float g0x=g0( fuv.x );
float g1x=g1( fuv.x );
float h0x=h0( fuv.x );
float h1x=h1( fuv.x );
float h0y=h0( fuv.y );
float h1y=h1( fuv.y );
vec2 p0=( vec2( iuv.x+h0x,iuv.y+h0y ) - .5 )*texelSize.xy;
vec2 p1=( vec2( iuv.x+h1x,iuv.y+h0y ) - .5 )*texelSize.xy;
vec2 p2=( vec2( iuv.x+h0x,iuv.y+h1y ) - .5 )*texelSize.xy;
vec2 p3=( vec2( iuv.x+h1x,iuv.y+h1y ) - .5 )*texelSize.xy;
return g0( fuv.y )*( g0x*textureLod( tex,p0,lod )+g1x*textureLod( tex,p1,lod ) )+
g1( fuv.y )*( g0x*textureLod( tex,p2,lod )+g1x*textureLod( tex,p3,lod ) );
}
vec4 textureBicubic( sampler2D sampler,vec2 uv,float lod ){
vec2 fLodSize=vec2( textureSize( sampler,int( lod ) ) );
vec2 cLodSize=vec2( textureSize( sampler,int( lod+1. ) ) );
vec2 fLodSizeInv=1./fLodSize;
vec2 cLodSizeInv=1./cLodSize;
vec4 fSample=bicubic( sampler,uv,vec4( fLodSizeInv,fLodSize ),floor( lod ) );
vec4 cSample=bicubic( sampler,uv,vec4( cLodSizeInv,cLodSize ),ceil( lod ) );
return mix( fSample,cSample,fract( lod ) );
}
vec3 getVolumeTransmissionRay( const in vec3 n,const in vec3 v,const in float thickness,const in float ior,const in mat4 modelMatrix ){
vec3 refractionVector=refract( - v,normalize( n ),1./ior );
vec3 modelScale;
modelScale.x=length( vec3( modelMatrix[ 0 ].xyz ) );
modelScale.y=length( vec3( modelMatrix[ 1 ].xyz ) );
modelScale.z=length( vec3( modelMatrix[ 2 ].xyz ) );
return normalize( refractionVector )*thickness*modelScale;
}
float applyIorToRoughness( const in float roughness,const in float ior ){
return roughness*clamp( ior*2. - 2.,.0,1. );
}
vec4 getTransmissionSample( const in vec2 fragCoord,const in float roughness,const in float ior ){
float lod=log2( transmissionSamplerSize.x )*applyIorToRoughness( roughness,ior );
return textureBicubic( transmissionSamplerMap,fragCoord.xy,lod );
}
vec3 volumeAttenuation( const in float transmissionDistance,const in vec3 attenuationColor,const in float attenuationDistance ){
if ( isinf( attenuationDistance ) ){
return vec3( 1. );
}else{
vec3 attenuationCoefficient=-log( attenuationColor )/attenuationDistance;
vec3 transmittance=exp( - attenuationCoefficient*transmissionDistance );
return transmittance;
}
}
vec4 getIBLVolumeRefraction( const in vec3 n,const in vec3 v,const in float roughness,const in vec3 diffuseColor,
const in vec3 specularColor,const in float specularF90,const in vec3 position,const in mat4 modelMatrix,
const in mat4 viewMatrix,const in mat4 projMatrix,const in float dispersion,const in float ior,const in float thickness,
const in vec3 attenuationColor,const in float attenuationDistance ){
vec4 transmittedLight;
vec3 transmittance;
#ifdef USE_DISPERSION
float halfSpread=( ior - 1. )*.025*dispersion;
vec3 iors=vec3( ior - halfSpread,ior,ior+halfSpread );
for ( int i=0;i<3;i++){
vec3 transmissionRay=getVolumeTransmissionRay( n,v,thickness,iors[ i ],modelMatrix );
vec3 refractedRayExit=position+transmissionRay;
vec4 ndcPos=projMatrix*viewMatrix*vec4( refractedRayExit,1. );
vec2 refractionCoords=ndcPos.xy/ndcPos.w;
refractionCoords+=1.;
refractionCoords/=2.;
vec4 transmissionSample=getTransmissionSample( refractionCoords,roughness,iors[ i ] );
transmittedLight[ i ]=transmissionSample[ i ];
transmittedLight.a+=transmissionSample.a;
transmittance[ i ]=diffuseColor[ i ]*volumeAttenuation( length( transmissionRay ),attenuationColor,attenuationDistance )[ i ];
}
transmittedLight.a/=3.;
#else
vec3 transmissionRay=getVolumeTransmissionRay( n,v,thickness,ior,modelMatrix );
vec3 refractedRayExit=position+transmissionRay;
vec4 ndcPos=projMatrix*viewMatrix*vec4( refractedRayExit,1. );
vec2 refractionCoords=ndcPos.xy/ndcPos.w;
refractionCoords+=1.;
refractionCoords/=2.;
transmittedLight=getTransmissionSample( refractionCoords,roughness,ior );
transmittance=diffuseColor*volumeAttenuation( length( transmissionRay ),attenuationColor,attenuationDistance );
#endif
vec3 attenuatedColor=transmittance*transmittedLight.rgb;
vec3 F=EnvironmentBRDF( n,v,specularColor,specularF90,roughness );
float transmittanceFactor=( transmittance.r+transmittance.g+transmittance.b )/3.;
return vec4( ( 1. - F )*attenuatedColor,1. - ( 1. - transmittedLight.a )*transmittanceFactor );
}
#endif
`,uv_pars_fragment:`
#if defined( USE_UV ) || defined( USE_ANISOTROPY )
varying vec2 vUv;
#endif
#ifdef USE_MAP
varying vec2 vMapUv;
#endif
#ifdef USE_ALPHAMAP
varying vec2 vAlphaMapUv;
#endif
#ifdef USE_LIGHTMAP
varying vec2 vLightMapUv;
#endif
#ifdef USE_AOMAP
varying vec2 vAoMapUv;
#endif
#ifdef USE_BUMPMAP
varying vec2 vBumpMapUv;
#endif
#ifdef USE_NORMALMAP
varying vec2 vNormalMapUv;
#endif
#ifdef USE_EMISSIVEMAP
varying vec2 vEmissiveMapUv;
#endif
#ifdef USE_METALNESSMAP
varying vec2 vMetalnessMapUv;
#endif
#ifdef USE_ROUGHNESSMAP
varying vec2 vRoughnessMapUv;
#endif
#ifdef USE_DIFFUSE_ROUGHNESSMAP
varying vec2 vDiffuseRoughnessMapUv;
#endif
#ifdef USE_ANISOTROPYMAP
varying vec2 vAnisotropyMapUv;
#endif
#ifdef USE_CLEARCOATMAP
varying vec2 vClearcoatMapUv;
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
varying vec2 vClearcoatNormalMapUv;
#endif
#ifdef USE_CLEARCOAT_ROUGHNESSMAP
varying vec2 vClearcoatRoughnessMapUv;
#endif
#ifdef USE_IRIDESCENCEMAP
varying vec2 vIridescenceMapUv;
#endif
#ifdef USE_IRIDESCENCE_THICKNESSMAP
varying vec2 vIridescenceThicknessMapUv;
#endif
#ifdef USE_SHEEN_COLORMAP
varying vec2 vSheenColorMapUv;
#endif
#ifdef USE_SHEEN_ROUGHNESSMAP
varying vec2 vSheenRoughnessMapUv;
#endif
#ifdef USE_SPECULARMAP
varying vec2 vSpecularMapUv;
#endif
#ifdef USE_SPECULAR_COLORMAP
varying vec2 vSpecularColorMapUv;
#endif
#ifdef USE_SPECULAR_INTENSITYMAP
varying vec2 vSpecularIntensityMapUv;
#endif
#ifdef USE_TRANSMISSIONMAP
uniform mat3 transmissionMapTransform;
varying vec2 vTransmissionMapUv;
#endif
#ifdef USE_THICKNESSMAP
uniform mat3 thicknessMapTransform;
varying vec2 vThicknessMapUv;
#endif
`,uv_pars_vertex:`
#if defined( USE_UV ) || defined( USE_ANISOTROPY )
varying vec2 vUv;
#endif
#ifdef USE_MAP
uniform mat3 mapTransform;
varying vec2 vMapUv;
#endif
#ifdef USE_ALPHAMAP
uniform mat3 alphaMapTransform;
varying vec2 vAlphaMapUv;
#endif
#ifdef USE_LIGHTMAP
uniform mat3 lightMapTransform;
varying vec2 vLightMapUv;
#endif
#ifdef USE_AOMAP
uniform mat3 aoMapTransform;
varying vec2 vAoMapUv;
#endif
#ifdef USE_BUMPMAP
uniform mat3 bumpMapTransform;
varying vec2 vBumpMapUv;
#endif
#ifdef USE_NORMALMAP
uniform mat3 normalMapTransform;
varying vec2 vNormalMapUv;
#endif
#ifdef USE_DISPLACEMENTMAP
uniform mat3 displacementMapTransform;
varying vec2 vDisplacementMapUv;
#endif
#ifdef USE_EMISSIVEMAP
uniform mat3 emissiveMapTransform;
varying vec2 vEmissiveMapUv;
#endif
#ifdef USE_METALNESSMAP
uniform mat3 metalnessMapTransform;
varying vec2 vMetalnessMapUv;
#endif
#ifdef USE_ROUGHNESSMAP
uniform mat3 roughnessMapTransform;
varying vec2 vRoughnessMapUv;
#endif
#ifdef USE_DIFFUSE_ROUGHNESSMAP
uniform mat3 diffuseRoughnessMapTransform;
varying vec2 vDiffuseRoughnessMapUv;
#endif
#ifdef USE_ANISOTROPYMAP
uniform mat3 anisotropyMapTransform;
varying vec2 vAnisotropyMapUv;
#endif
#ifdef USE_CLEARCOATMAP
uniform mat3 clearcoatMapTransform;
varying vec2 vClearcoatMapUv;
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
uniform mat3 clearcoatNormalMapTransform;
varying vec2 vClearcoatNormalMapUv;
#endif
#ifdef USE_CLEARCOAT_ROUGHNESSMAP
uniform mat3 clearcoatRoughnessMapTransform;
varying vec2 vClearcoatRoughnessMapUv;
#endif
#ifdef USE_SHEEN_COLORMAP
uniform mat3 sheenColorMapTransform;
varying vec2 vSheenColorMapUv;
#endif
#ifdef USE_SHEEN_ROUGHNESSMAP
uniform mat3 sheenRoughnessMapTransform;
varying vec2 vSheenRoughnessMapUv;
#endif
#ifdef USE_IRIDESCENCEMAP
uniform mat3 iridescenceMapTransform;
varying vec2 vIridescenceMapUv;
#endif
#ifdef USE_IRIDESCENCE_THICKNESSMAP
uniform mat3 iridescenceThicknessMapTransform;
varying vec2 vIridescenceThicknessMapUv;
#endif
#ifdef USE_SPECULARMAP
uniform mat3 specularMapTransform;
varying vec2 vSpecularMapUv;
#endif
#ifdef USE_SPECULAR_COLORMAP
uniform mat3 specularColorMapTransform;
varying vec2 vSpecularColorMapUv;
#endif
#ifdef USE_SPECULAR_INTENSITYMAP
uniform mat3 specularIntensityMapTransform;
varying vec2 vSpecularIntensityMapUv;
#endif
#ifdef USE_TRANSMISSIONMAP
uniform mat3 transmissionMapTransform;
varying vec2 vTransmissionMapUv;
#endif
#ifdef USE_THICKNESSMAP
uniform mat3 thicknessMapTransform;
varying vec2 vThicknessMapUv;
#endif
`,uv_vertex:`
#if defined( USE_UV ) || defined( USE_ANISOTROPY )
vUv=vec3( uv,1 ).xy;
#endif
#ifdef USE_MAP
vMapUv=( mapTransform*vec3( MAP_UV,1 ) ).xy;
#endif
#ifdef USE_ALPHAMAP
vAlphaMapUv=( alphaMapTransform*vec3( ALPHAMAP_UV,1 ) ).xy;
#endif
#ifdef USE_LIGHTMAP
vLightMapUv=( lightMapTransform*vec3( LIGHTMAP_UV,1 ) ).xy;
#endif
#ifdef USE_AOMAP
vAoMapUv=( aoMapTransform*vec3( AOMAP_UV,1 ) ).xy;
#endif
#ifdef USE_BUMPMAP
vBumpMapUv=( bumpMapTransform*vec3( BUMPMAP_UV,1 ) ).xy;
#endif
#ifdef USE_NORMALMAP
vNormalMapUv=( normalMapTransform*vec3( NORMALMAP_UV,1 ) ).xy;
#endif
#ifdef USE_DISPLACEMENTMAP
vDisplacementMapUv=( displacementMapTransform*vec3( DISPLACEMENTMAP_UV,1 ) ).xy;
#endif
#ifdef USE_EMISSIVEMAP
vEmissiveMapUv=( emissiveMapTransform*vec3( EMISSIVEMAP_UV,1 ) ).xy;
#endif
#ifdef USE_METALNESSMAP
vMetalnessMapUv=( metalnessMapTransform*vec3( METALNESSMAP_UV,1 ) ).xy;
#endif
#ifdef USE_ROUGHNESSMAP
vRoughnessMapUv=( roughnessMapTransform*vec3( ROUGHNESSMAP_UV,1 ) ).xy;
#endif
#ifdef USE_DIFFUSE_ROUGHNESSMAP
vDiffuseRoughnessMapUv=( diffuseRoughnessMapTransform*vec3( DIFFUSE_ROUGHNESSMAP_UV,1 ) ).xy;
#endif
#ifdef USE_ANISOTROPYMAP
vAnisotropyMapUv=( anisotropyMapTransform*vec3( ANISOTROPYMAP_UV,1 ) ).xy;
#endif
#ifdef USE_CLEARCOATMAP
vClearcoatMapUv=( clearcoatMapTransform*vec3( CLEARCOATMAP_UV,1 ) ).xy;
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
vClearcoatNormalMapUv=( clearcoatNormalMapTransform*vec3( CLEARCOAT_NORMALMAP_UV,1 ) ).xy;
#endif
#ifdef USE_CLEARCOAT_ROUGHNESSMAP
vClearcoatRoughnessMapUv=( clearcoatRoughnessMapTransform*vec3( CLEARCOAT_ROUGHNESSMAP_UV,1 ) ).xy;
#endif
#ifdef USE_IRIDESCENCEMAP
vIridescenceMapUv=( iridescenceMapTransform*vec3( IRIDESCENCEMAP_UV,1 ) ).xy;
#endif
#ifdef USE_IRIDESCENCE_THICKNESSMAP
vIridescenceThicknessMapUv=( iridescenceThicknessMapTransform*vec3( IRIDESCENCE_THICKNESSMAP_UV,1 ) ).xy;
#endif
#ifdef USE_SHEEN_COLORMAP
vSheenColorMapUv=( sheenColorMapTransform*vec3( SHEEN_COLORMAP_UV,1 ) ).xy;
#endif
#ifdef USE_SHEEN_ROUGHNESSMAP
vSheenRoughnessMapUv=( sheenRoughnessMapTransform*vec3( SHEEN_ROUGHNESSMAP_UV,1 ) ).xy;
#endif
#ifdef USE_SPECULARMAP
vSpecularMapUv=( specularMapTransform*vec3( SPECULARMAP_UV,1 ) ).xy;
#endif
#ifdef USE_SPECULAR_COLORMAP
vSpecularColorMapUv=( specularColorMapTransform*vec3( SPECULAR_COLORMAP_UV,1 ) ).xy;
#endif
#ifdef USE_SPECULAR_INTENSITYMAP
vSpecularIntensityMapUv=( specularIntensityMapTransform*vec3( SPECULAR_INTENSITYMAP_UV,1 ) ).xy;
#endif
#ifdef USE_TRANSMISSIONMAP
vTransmissionMapUv=( transmissionMapTransform*vec3( TRANSMISSIONMAP_UV,1 ) ).xy;
#endif
#ifdef USE_THICKNESSMAP
vThicknessMapUv=( thicknessMapTransform*vec3( THICKNESSMAP_UV,1 ) ).xy;
#endif
`,worldpos_vertex:`
#if defined( USE_ENVMAP ) || defined( DISTANCE ) || defined ( USE_SHADOWMAP ) || defined ( USE_TRANSMISSION ) || NUM_SPOT_LIGHT_COORDS > 0
vec4 worldPosition=vec4( transformed,1. );
#ifdef USE_BATCHING
worldPosition=batchingMatrix*worldPosition;
#endif
#ifdef USE_INSTANCING
worldPosition=instanceMatrix*worldPosition;
#endif
worldPosition=modelMatrix*worldPosition;
#endif
`});function Ft(a,e){if(e===Rn)return console.warn("THREE.BufferGeometryUtils.toTrianglesDrawMode(): Geometry already defined as triangles."),a;if(e===ve||e===Fe){let t=a.getIndex();if(t===null){let i=[],o=a.getAttribute("position");if(o!==void 0){for(let s=0;s<o.count;s++)i.push(s);a.setIndex(i),t=a.getIndex()}else return console.error("THREE.BufferGeometryUtils.toTrianglesDrawMode(): Undefined position attribute. Processing not possible."),a}let n=t.count-2,r=[];if(e===ve)for(let i=1;i<=n;i++)r.push(t.getX(0)),r.push(t.getX(i)),r.push(t.getX(i+1));else for(let i=0;i<n;i++)i%2===0?(r.push(t.getX(i)),r.push(t.getX(i+1)),r.push(t.getX(i+2))):(r.push(t.getX(i+2)),r.push(t.getX(i+1)),r.push(t.getX(i)));return r.length/3!==n&&console.error("THREE.BufferGeometryUtils.toTrianglesDrawMode(): Unable to generate correct amount of triangles."),a.setIndex(r),a.clearGroups(),a}else return console.error("THREE.BufferGeometryUtils.toTrianglesDrawMode(): Unknown draw mode:",e),a}function Sr(a){let e=new Map,t=new Map,n=a.clone();return xr(a,n,function(r,i){e.set(i,r),t.set(r,i)}),n.traverse(function(r){if(!r.isSkinnedMesh)return;let i=r,o=e.get(r),s=o.skeleton.bones;i.skeleton=o.skeleton.clone(),i.bindMatrix.copy(o.bindMatrix),i.skeleton.bones=s.map(function(c){return t.get(c)}),i.bind(i.skeleton,i.bindMatrix)}),n}function xr(a,e,t){t(a,e);for(let n=0;n<a.children.length;n++)xr(a.children[n],e.children[n],t)}var Qe=class extends ur{constructor(e){super(e),this.dracoLoader=null,this.ktx2Loader=null,this.meshoptDecoder=null,this.pluginCallbacks=[],this.register(function(t){return new Wt(t)}),this.register(function(t){return new Xt(t)}),this.register(function(t){return new jt(t)}),this.register(function(t){return new tn(t)}),this.register(function(t){return new nn(t)}),this.register(function(t){return new rn(t)}),this.register(function(t){return new qt(t)}),this.register(function(t){return new Yt(t)}),this.register(function(t){return new Zt(t)}),this.register(function(t){return new Jt(t)}),this.register(function(t){return new zt(t)}),this.register(function(t){return new $t(t)}),this.register(function(t){return new Kt(t)}),this.register(function(t){return new en(t)}),this.register(function(t){return new Qt(t)}),this.register(function(t){return new Vt(t)}),this.register(function(t){return new et(t,_.EXT_MESHOPT_COMPRESSION)}),this.register(function(t){return new et(t,_.KHR_MESHOPT_COMPRESSION)}),this.register(function(t){return new on(t)})}load(e,t,n,r){let i=this,o;if(this.resourcePath!=="")o=this.resourcePath;else if(this.path!==""){let l=pe.extractUrlBase(e);o=pe.resolveURL(l,this.path)}else o=pe.extractUrlBase(e);this.manager.itemStart(e);let s=function(l){r?r(l):console.error(l),i.manager.itemError(e),i.manager.itemEnd(e)},c=new fe(this.manager);c.setPriority(this.priority),c.setCache(this.cache),c.setPath(this.path),c.setResponseType("arraybuffer"),c.setRequestHeader(this.requestHeader),c.setWithCredentials(this.withCredentials),c.load(e,function(l){try{i.parse(l,o,function(f){t(f),i.manager.itemEnd(e)},s)}catch(f){s(f)}},n,s)}setDRACOLoader(e){return this.dracoLoader=e,this}setKTX2Loader(e){return this.ktx2Loader=e,this}setMeshoptDecoder(e){return this.meshoptDecoder=e,this}register(e){return this.pluginCallbacks.indexOf(e)===-1&&this.pluginCallbacks.push(e),this}unregister(e){return this.pluginCallbacks.indexOf(e)!==-1&&this.pluginCallbacks.splice(this.pluginCallbacks.indexOf(e),1),this}parse(e,t,n,r){let i,o={},s={},c=new TextDecoder;if(typeof e=="string")i=JSON.parse(e);else if(e instanceof ArrayBuffer)if(c.decode(new Uint8Array(e,0,4))===Ar){try{o[_.KHR_BINARY_GLTF]=new an(e)}catch(d){r&&r(d);return}i=JSON.parse(o[_.KHR_BINARY_GLTF].content)}else i=JSON.parse(c.decode(e));else i=e;if(i.asset===void 0||i.asset.version[0]<2){r&&r(new Error("THREE.GLTFLoader: Unsupported asset. glTF versions >=2.0 are supported."));return}let l=new hn(i,{path:t||this.resourcePath||"",crossOrigin:this.crossOrigin,priority:this.priority,cache:this.cache,withCredentials:this.withCredentials,requestHeader:this.requestHeader,manager:this.manager,ktx2Loader:this.ktx2Loader,meshoptDecoder:this.meshoptDecoder});l.fileLoader.setRequestHeader(this.requestHeader);for(let f=0;f<this.pluginCallbacks.length;f++){let d=this.pluginCallbacks[f](l);d.name||console.error("THREE.GLTFLoader: Invalid plugin found: missing name"),s[d.name]=d,o[d.name]=!0}if(i.extensionsUsed)for(let f=0;f<i.extensionsUsed.length;++f){let d=i.extensionsUsed[f],u=i.extensionsRequired||[];switch(d){case _.KHR_MATERIALS_UNLIT:o[d]=new Gt;break;case _.KHR_DRACO_MESH_COMPRESSION:o[d]=new sn(i,this.dracoLoader);break;case _.KHR_TEXTURE_TRANSFORM:o[d]=new cn;break;case _.KHR_MESH_QUANTIZATION:o[d]=new ln;break;default:u.indexOf(d)>=0&&s[d]===void 0&&console.warn('THREE.GLTFLoader: Unknown extension "'+d+'".')}}l.setExtensions(o),l.setPlugins(s),l.parse(n,r)}parseAsync(e,t){let n=this;return new Promise(function(r,i){n.parse(e,t,r,i)})}};function Mi(){let a={};return{get:function(e){return a[e]},add:function(e,t){a[e]=t},remove:function(e){delete a[e]},removeAll:function(){a={}}}}function A(a,e,t){let n=a.json.materials[e];return n.extensions&&n.extensions[t]?n.extensions[t]:null}var _={KHR_BINARY_GLTF:"KHR_binary_glTF",KHR_DRACO_MESH_COMPRESSION:"KHR_draco_mesh_compression",KHR_LIGHTS_PUNCTUAL:"KHR_lights_punctual",KHR_MATERIALS_CLEARCOAT:"KHR_materials_clearcoat",KHR_MATERIALS_DIFFUSE_ROUGHNESS:"KHR_materials_diffuse_roughness",KHR_MATERIALS_DISPERSION:"KHR_materials_dispersion",KHR_MATERIALS_IOR:"KHR_materials_ior",KHR_MATERIALS_SHEEN:"KHR_materials_sheen",KHR_MATERIALS_SPECULAR:"KHR_materials_specular",KHR_MATERIALS_TRANSMISSION:"KHR_materials_transmission",KHR_MATERIALS_IRIDESCENCE:"KHR_materials_iridescence",KHR_MATERIALS_ANISOTROPY:"KHR_materials_anisotropy",KHR_MATERIALS_UNLIT:"KHR_materials_unlit",KHR_MATERIALS_VOLUME:"KHR_materials_volume",KHR_TEXTURE_BASISU:"KHR_texture_basisu",KHR_TEXTURE_TRANSFORM:"KHR_texture_transform",KHR_MESH_QUANTIZATION:"KHR_mesh_quantization",KHR_MATERIALS_EMISSIVE_STRENGTH:"KHR_materials_emissive_strength",EXT_MATERIALS_BUMP:"EXT_materials_bump",EXT_TEXTURE_WEBP:"EXT_texture_webp",EXT_TEXTURE_AVIF:"EXT_texture_avif",EXT_MESHOPT_COMPRESSION:"EXT_meshopt_compression",KHR_MESHOPT_COMPRESSION:"KHR_meshopt_compression",EXT_MESH_GPU_INSTANCING:"EXT_mesh_gpu_instancing"},Vt=class{constructor(e){this.parser=e,this.name=_.KHR_LIGHTS_PUNCTUAL,this.cache={refs:{},uses:{}}}_markDefs(){let e=this.parser,t=this.parser.json.nodes||[];for(let n=0,r=t.length;n<r;n++){let i=t[n];i.extensions&&i.extensions[this.name]&&i.extensions[this.name].light!==void 0&&e._addNodeRef(this.cache,i.extensions[this.name].light)}}_loadLight(e){let t=this.parser,n="light:"+e,r=t.cache.get(n);if(r)return r;let i=t.json,c=((i.extensions&&i.extensions[this.name]||{}).lights||[])[e],l,f=new Y(16777215);c.color!==void 0&&f.setRGB(c.color[0],c.color[1],c.color[2],H);let d=c.range!==void 0?c.range:0;switch(c.type){case"directional":l=new ar(f),l.target.position.set(0,0,-1),l.add(l.target);break;case"point":l=new Ie(f),l.distance=d;break;case"spot":l=new Ne(f),l.distance=d,c.spot=c.spot||{},c.spot.innerConeAngle=c.spot.innerConeAngle!==void 0?c.spot.innerConeAngle:0,c.spot.outerConeAngle=c.spot.outerConeAngle!==void 0?c.spot.outerConeAngle:Math.PI/4,l.angle=c.spot.outerConeAngle,l.penumbra=1-c.spot.innerConeAngle/c.spot.outerConeAngle,l.target.position.set(0,0,-1),l.add(l.target);break;default:throw new Error("THREE.GLTFLoader: Unexpected light type: "+c.type)}return l.position.set(0,0,0),V(l,c),c.intensity!==void 0&&(l.intensity=c.intensity),l.name=t.createUniqueName(c.name||"light_"+e),r=Promise.resolve(l),t.cache.add(n,r),r}getDependency(e,t){if(e==="light")return this._loadLight(t)}createNodeAttachment(e){let t=this,n=this.parser,i=n.json.nodes[e],s=(i.extensions&&i.extensions[this.name]||{}).light;return s===void 0?null:this._loadLight(s).then(function(c){return n._getNodeRef(t.cache,s,c)})}},Gt=class{constructor(){this.name=_.KHR_MATERIALS_UNLIT}getMaterialType(){return me}extendParams(e,t,n){let r=[];e.color=new Y(1,1,1),e.opacity=1;let i=t.pbrMetallicRoughness;if(i){if(Array.isArray(i.baseColorFactor)){let o=i.baseColorFactor;e.color.setRGB(o[0],o[1],o[2],H),e.opacity=o[3]}i.baseColorTexture!==void 0&&r.push(n.assignTexture(e,"map",i.baseColorTexture,ae))}return Promise.all(r)}},zt=class{constructor(e){this.parser=e,this.name=_.KHR_MATERIALS_EMISSIVE_STRENGTH}extendMaterialParams(e,t){let n=A(this.parser,e,this.name);return n===null||n.emissiveStrength!==void 0&&(t.emissiveIntensity=n.emissiveStrength),Promise.resolve()}},Wt=class{constructor(e){this.parser=e,this.name=_.KHR_MATERIALS_CLEARCOAT}getMaterialType(e){return A(this.parser,e,this.name)!==null?P:null}extendMaterialParams(e,t){let n=A(this.parser,e,this.name);if(n===null)return Promise.resolve();let r=[];if(n.clearcoatFactor!==void 0&&(t.clearcoat=n.clearcoatFactor),n.clearcoatTexture!==void 0&&r.push(this.parser.assignTexture(t,"clearcoatMap",n.clearcoatTexture)),n.clearcoatRoughnessFactor!==void 0&&(t.clearcoatRoughness=n.clearcoatRoughnessFactor),n.clearcoatRoughnessTexture!==void 0&&r.push(this.parser.assignTexture(t,"clearcoatRoughnessMap",n.clearcoatRoughnessTexture)),n.clearcoatNormalTexture!==void 0&&(r.push(this.parser.assignTexture(t,"clearcoatNormalMap",n.clearcoatNormalTexture)),n.clearcoatNormalTexture.scale!==void 0)){let i=n.clearcoatNormalTexture.scale;t.clearcoatNormalScale=new Le(i,i)}return Promise.all(r)}},Xt=class{constructor(e){this.parser=e,this.name=_.KHR_MATERIALS_DIFFUSE_ROUGHNESS}getMaterialType(e){return A(this.parser,e,this.name)!==null?P:null}extendMaterialParams(e,t){let n=A(this.parser,e,this.name);if(n===null)return Promise.resolve();let r=[];return t.diffuseRoughness=n.diffuseRoughnessFactor!==void 0?n.diffuseRoughnessFactor:0,n.diffuseRoughnessTexture!==void 0&&r.push(this.parser.assignTexture(t,"diffuseRoughnessMap",n.diffuseRoughnessTexture)),Promise.all(r)}},jt=class{constructor(e){this.parser=e,this.name=_.KHR_MATERIALS_DISPERSION}getMaterialType(e){return A(this.parser,e,this.name)!==null?P:null}extendMaterialParams(e,t){let n=A(this.parser,e,this.name);return n===null||(t.dispersion=n.dispersion!==void 0?n.dispersion:0),Promise.resolve()}},Kt=class{constructor(e){this.parser=e,this.name=_.KHR_MATERIALS_IRIDESCENCE}getMaterialType(e){return A(this.parser,e,this.name)!==null?P:null}extendMaterialParams(e,t){let n=A(this.parser,e,this.name);if(n===null)return Promise.resolve();let r=[];return n.iridescenceFactor!==void 0&&(t.iridescence=n.iridescenceFactor),n.iridescenceTexture!==void 0&&r.push(this.parser.assignTexture(t,"iridescenceMap",n.iridescenceTexture)),n.iridescenceIor!==void 0&&(t.iridescenceIOR=n.iridescenceIor),n.iridescenceThicknessMinimum!==void 0&&(t.iridescenceThicknessMinimum=n.iridescenceThicknessMinimum),n.iridescenceThicknessMaximum!==void 0&&(t.iridescenceThicknessMaximum=n.iridescenceThicknessMaximum),n.iridescenceThicknessTexture!==void 0&&r.push(this.parser.assignTexture(t,"iridescenceThicknessMap",n.iridescenceThicknessTexture)),Promise.all(r)}},qt=class{constructor(e){this.parser=e,this.name=_.KHR_MATERIALS_SHEEN}getMaterialType(e){return A(this.parser,e,this.name)!==null?P:null}extendMaterialParams(e,t){let n=A(this.parser,e,this.name);if(n===null)return Promise.resolve();let r=[];if(t.sheenColor=new Y(0,0,0),t.sheenRoughness=0,t.sheen=1,n.sheenColorFactor!==void 0){let i=n.sheenColorFactor;t.sheenColor.setRGB(i[0],i[1],i[2],H)}return n.sheenRoughnessFactor!==void 0&&(t.sheenRoughness=n.sheenRoughnessFactor),n.sheenColorTexture!==void 0&&r.push(this.parser.assignTexture(t,"sheenColorMap",n.sheenColorTexture,ae)),n.sheenRoughnessTexture!==void 0&&r.push(this.parser.assignTexture(t,"sheenRoughnessMap",n.sheenRoughnessTexture)),Promise.all(r)}},Yt=class{constructor(e){this.parser=e,this.name=_.KHR_MATERIALS_TRANSMISSION}getMaterialType(e){return A(this.parser,e,this.name)!==null?P:null}extendMaterialParams(e,t){let n=A(this.parser,e,this.name);if(n===null)return Promise.resolve();let r=[];return n.transmissionFactor!==void 0&&(t.transmission=n.transmissionFactor),n.transmissionTexture!==void 0&&r.push(this.parser.assignTexture(t,"transmissionMap",n.transmissionTexture)),Promise.all(r)}},Zt=class{constructor(e){this.parser=e,this.name=_.KHR_MATERIALS_VOLUME}getMaterialType(e){return A(this.parser,e,this.name)!==null?P:null}extendMaterialParams(e,t){let n=A(this.parser,e,this.name);if(n===null)return Promise.resolve();let r=[];t.thickness=n.thicknessFactor!==void 0?n.thicknessFactor:0,n.thicknessTexture!==void 0&&r.push(this.parser.assignTexture(t,"thicknessMap",n.thicknessTexture)),t.attenuationDistance=n.attenuationDistance||1/0;let i=n.attenuationColor||[1,1,1];return t.attenuationColor=new Y().setRGB(i[0],i[1],i[2],H),Promise.all(r)}},Jt=class{constructor(e){this.parser=e,this.name=_.KHR_MATERIALS_IOR}getMaterialType(e){return A(this.parser,e,this.name)!==null?P:null}extendMaterialParams(e,t){let n=A(this.parser,e,this.name);return n===null||(t.ior=n.ior!==void 0?n.ior:1.5,t.ior===0&&(t.ior=1e3)),Promise.resolve()}},$t=class{constructor(e){this.parser=e,this.name=_.KHR_MATERIALS_SPECULAR}getMaterialType(e){return A(this.parser,e,this.name)!==null?P:null}extendMaterialParams(e,t){let n=A(this.parser,e,this.name);if(n===null)return Promise.resolve();let r=[];t.specularIntensity=n.specularFactor!==void 0?n.specularFactor:1,n.specularTexture!==void 0&&r.push(this.parser.assignTexture(t,"specularIntensityMap",n.specularTexture));let i=n.specularColorFactor||[1,1,1];return t.specularColor=new Y().setRGB(i[0],i[1],i[2],H),n.specularColorTexture!==void 0&&r.push(this.parser.assignTexture(t,"specularColorMap",n.specularColorTexture,ae)),Promise.all(r)}},Qt=class{constructor(e){this.parser=e,this.name=_.EXT_MATERIALS_BUMP}getMaterialType(e){return A(this.parser,e,this.name)!==null?P:null}extendMaterialParams(e,t){let n=A(this.parser,e,this.name);if(n===null)return Promise.resolve();let r=[];return t.bumpScale=n.bumpFactor!==void 0?n.bumpFactor:1,n.bumpTexture!==void 0&&r.push(this.parser.assignTexture(t,"bumpMap",n.bumpTexture)),Promise.all(r)}},en=class{constructor(e){this.parser=e,this.name=_.KHR_MATERIALS_ANISOTROPY}getMaterialType(e){return A(this.parser,e,this.name)!==null?P:null}extendMaterialParams(e,t){let n=A(this.parser,e,this.name);if(n===null)return Promise.resolve();let r=[];return n.anisotropyStrength!==void 0&&(t.anisotropy=n.anisotropyStrength),n.anisotropyRotation!==void 0&&(t.anisotropyRotation=n.anisotropyRotation),n.anisotropyTexture!==void 0&&r.push(this.parser.assignTexture(t,"anisotropyMap",n.anisotropyTexture)),Promise.all(r)}},tn=class{constructor(e){this.parser=e,this.name=_.KHR_TEXTURE_BASISU}loadTexture(e){let t=this.parser,n=t.json,r=n.textures[e];if(!r.extensions||!r.extensions[this.name])return null;let i=r.extensions[this.name],o=t.options.ktx2Loader;if(!o){if(n.extensionsRequired&&n.extensionsRequired.indexOf(this.name)>=0)throw new Error("THREE.GLTFLoader: setKTX2Loader must be called before loading KTX2 textures");return null}return t.loadTextureImage(e,i.source,o)}},nn=class{constructor(e){this.parser=e,this.name=_.EXT_TEXTURE_WEBP}loadTexture(e){let t=this.name,n=this.parser,r=n.json,i=r.textures[e];if(!i.extensions||!i.extensions[t])return null;let o=i.extensions[t],s=r.images[o.source],c=n.textureLoader;if(s.uri){let l=n.options.manager.getHandler(s.uri);l!==null&&(c=l)}return n.loadTextureImage(e,o.source,c)}},rn=class{constructor(e){this.parser=e,this.name=_.EXT_TEXTURE_AVIF}loadTexture(e){let t=this.name,n=this.parser,r=n.json,i=r.textures[e];if(!i.extensions||!i.extensions[t])return null;let o=i.extensions[t],s=r.images[o.source],c=n.textureLoader;if(s.uri){let l=n.options.manager.getHandler(s.uri);l!==null&&(c=l)}return n.loadTextureImage(e,o.source,c)}},et=class{constructor(e,t){this.name=t,this.parser=e}loadBufferView(e){let t=this.parser.json,n=t.bufferViews[e];if(n.extensions&&n.extensions[this.name]){let r=n.extensions[this.name],i=this.parser.getDependency("buffer",r.buffer),o=this.parser.options.meshoptDecoder;if(!o||!o.supported){if(t.extensionsRequired&&t.extensionsRequired.indexOf(this.name)>=0)throw new Error("THREE.GLTFLoader: setMeshoptDecoder must be called before loading compressed files");return null}return i.then(function(s){let c=r.byteOffset||0,l=r.byteLength||0,f=r.count,d=r.byteStride,u=new Uint8Array(s,c,l);return o.decodeGltfBufferAsync?o.decodeGltfBufferAsync(f,d,u,r.mode,r.filter).then(function(h){return h.buffer}):o.ready.then(function(){let h=new ArrayBuffer(f*d);return o.decodeGltfBuffer(new Uint8Array(h),f,d,u,r.mode,r.filter),h})})}else return null}},on=class{constructor(e){this.name=_.EXT_MESH_GPU_INSTANCING,this.parser=e}createNodeMesh(e){let t=this.parser.json,n=t.nodes[e];if(!n.extensions||!n.extensions[this.name]||n.mesh===void 0)return null;let r=t.meshes[n.mesh];for(let l of r.primitives)if(l.mode!==F.TRIANGLES&&l.mode!==F.TRIANGLE_STRIP&&l.mode!==F.TRIANGLE_FAN&&l.mode!==void 0)return null;let o=n.extensions[this.name].attributes,s=[],c={};for(let l in o)s.push(this.parser.getDependency("accessor",o[l]).then(f=>(c[l]=f,c[l])));return s.length<1?null:(s.push(this.parser.createNodeMesh(e)),Promise.all(s).then(l=>{let f=l.pop(),d=f.isGroup?f.children:[f],u=l[0].count,h=[];for(let p of d){let g=new Re,m=new q,v=new Ut,y=new q(1,1,1),M=new cr(p.geometry,p.material,u);for(let x=0;x<u;x++)c.TRANSLATION&&m.fromBufferAttribute(c.TRANSLATION,x),c.ROTATION&&v.fromBufferAttribute(c.ROTATION,x),c.SCALE&&y.fromBufferAttribute(c.SCALE,x),M.setMatrixAt(x,g.compose(m,v,y));let S=null;for(let x in c)if(x==="_COLOR_0"){let N=c[x];M.instanceColor=new Je(N.array,N.itemSize,N.normalized)}else if(x!=="TRANSLATION"&&x!=="ROTATION"&&x!=="SCALE"){if(S===null){let T=M.geometry;S=new Ye,S.name=T.name;for(let w in T.attributes)S.setAttribute(w,T.attributes[w]);for(let w in T.morphAttributes)S.morphAttributes[w]=T.morphAttributes[w];T.index!==null&&S.setIndex(T.index),S.morphTargetsRelative=T.morphTargetsRelative;for(let w of T.groups)S.addGroup(w.start,w.count,w.materialIndex);T.boundingBox!==null&&(S.boundingBox=T.boundingBox.clone()),T.boundingSphere!==null&&(S.boundingSphere=T.boundingSphere.clone()),S.drawRange.start=T.drawRange.start,S.drawRange.count=T.drawRange.count,S.userData=Object.assign({},T.userData),M.geometry=S}let N=c[x];S.setAttribute(x,new Je(N.array,N.itemSize,N.normalized))}be.prototype.copy.call(M,p),this.parser.assignFinalMaterial(M),h.push(M)}return f.isGroup?(f.clear(),f.add(...h),f):h[0]}))}},Ar="glTF",Ce=12,Mr={JSON:1313821514,BIN:5130562},an=class{constructor(e){this.name=_.KHR_BINARY_GLTF,this.content=null,this.body=null;let t=new DataView(e,0,Ce),n=new TextDecoder;if(this.header={magic:n.decode(new Uint8Array(e.slice(0,4))),version:t.getUint32(4,!0),length:t.getUint32(8,!0)},this.header.magic!==Ar)throw new Error("THREE.GLTFLoader: Unsupported glTF-Binary header.");if(this.header.version<2)throw new Error("THREE.GLTFLoader: Legacy binary file detected.");let r=this.header.length-Ce,i=new DataView(e,Ce),o=0;for(;o<r;){let s=i.getUint32(o,!0);o+=4;let c=i.getUint32(o,!0);if(o+=4,c===Mr.JSON){let l=new Uint8Array(e,Ce+o,s);this.content=n.decode(l)}else if(c===Mr.BIN){let l=Ce+o;this.body=e.slice(l,l+s)}o+=s}if(this.content===null)throw new Error("THREE.GLTFLoader: JSON content not found.")}},sn=class{constructor(e,t){if(!t)throw new Error("THREE.GLTFLoader: No DRACOLoader instance provided.");this.name=_.KHR_DRACO_MESH_COMPRESSION,this.json=e,this.dracoLoader=t,this.dracoLoader.preload()}decodePrimitive(e,t){let n=this.json,r=this.dracoLoader,i=e.extensions[this.name].bufferView,o=e.extensions[this.name].attributes,s={},c={},l={};for(let f in o){let d=dn[f]||f.toLowerCase();s[d]=o[f]}for(let f in e.attributes){let d=dn[f]||f.toLowerCase();if(o[f]!==void 0){let u=n.accessors[e.attributes[f]],h=ge[u.componentType];l[d]=h.name,c[d]=u.normalized===!0}}return t.getDependency("bufferView",i).then(function(f){return new Promise(function(d,u){r.decodeDracoFile(f,function(h){for(let p in h.attributes){let g=h.attributes[p],m=c[p];m!==void 0&&(g.normalized=m)}d(h)},s,l,H,u)})})}},cn=class{constructor(){this.name=_.KHR_TEXTURE_TRANSFORM}extendTexture(e,t){if((t.texCoord===void 0||t.texCoord===e.channel)&&t.offset===void 0&&t.rotation===void 0&&t.scale===void 0)return e;if(e=e.clone(),t.texCoord!==void 0&&(e.channel=t.texCoord),t.offset!==void 0&&e.offset.fromArray(t.offset),t.rotation!==void 0&&(e.rotation=t.rotation),t.scale!==void 0&&e.repeat.fromArray(t.scale),t.rotation!==void 0){let n=Math.cos(e.rotation),r=Math.sin(e.rotation);e.matrix.set(e.repeat.x*n,e.repeat.y*r,e.offset.x,-e.repeat.x*r,e.repeat.y*n,e.offset.y,0,0,1),e.matrixAutoUpdate=!1}return e.needsUpdate=!0,e}},ln=class{constructor(){this.name=_.KHR_MESH_QUANTIZATION}},tt=class extends D{constructor(e,t,n,r){super(e,t,n,r)}copySampleValue_(e){let t=this.resultBuffer,n=this.sampleValues,r=this.valueSize,i=e*r*3+r;for(let o=0;o!==r;o++)t[o]=n[i+o];return t}interpolate_(e,t,n,r){let i=this.resultBuffer,o=this.sampleValues,s=this.valueSize,c=s*2,l=s*3,f=r-t,d=(n-t)/f,u=d*d,h=u*d,p=e*l,g=p-l,m=-2*h+3*u,v=h-u,y=1-m,M=v-u+d;for(let S=0;S!==s;S++){let x=o[g+S+s],N=o[g+S+c]*f,T=o[p+S+s],w=o[p+S]*f;i[S]=y*x+M*N+m*T+v*w}return i}},Ti=new Ut,fn=class extends tt{interpolate_(e,t,n,r){let i=super.interpolate_(e,t,n,r);return Ti.fromArray(i).normalize().toArray(i),i}},F={FLOAT:5126,FLOAT_MAT3:35675,FLOAT_MAT4:35676,FLOAT_VEC2:35664,FLOAT_VEC3:35665,FLOAT_VEC4:35666,LINEAR:9729,REPEAT:10497,SAMPLER_2D:35678,POINTS:0,LINES:1,LINE_LOOP:2,LINE_STRIP:3,TRIANGLES:4,TRIANGLE_STRIP:5,TRIANGLE_FAN:6,UNSIGNED_BYTE:5121,UNSIGNED_SHORT:5123},ge={5120:Int8Array,5121:Uint8Array,5122:Int16Array,5123:Uint16Array,5125:Uint32Array,5126:Float32Array},Tr={9728:Dt,9729:Ue,9984:Tn,9985:En,9986:yn,9987:ht},yr={33071:xn,33648:Mn,10497:De},Ht={SCALAR:1,VEC2:2,VEC3:3,VEC4:4,MAT2:4,MAT3:9,MAT4:16},dn={POSITION:"position",NORMAL:"normal",TANGENT:"tangent",TEXCOORD_0:"uv",TEXCOORD_1:"uv1",TEXCOORD_2:"uv2",TEXCOORD_3:"uv3",COLOR_0:"color",WEIGHTS_0:"skinWeight",JOINTS_0:"skinIndex"},Z={scale:"scale",translation:"position",rotation:"quaternion",weights:"morphTargetInfluences"},yi={CUBICSPLINE:void 0,LINEAR:J,STEP:z},Bt={OPAQUE:"OPAQUE",MASK:"MASK",BLEND:"BLEND"};function Ei(a){return a.DefaultMaterial===void 0&&(a.DefaultMaterial=new Pt({color:16777215,emissive:0,metalness:1,roughness:1,transparent:!1,depthTest:!0,side:_n})),a.DefaultMaterial}function ie(a,e,t){for(let n in t.extensions)a[n]===void 0&&(e.userData.gltfExtensions=e.userData.gltfExtensions||{},e.userData.gltfExtensions[n]=t.extensions[n])}function V(a,e){e.extras!==void 0&&(typeof e.extras=="object"?Object.assign(a.userData,e.extras):console.warn("THREE.GLTFLoader: Ignoring primitive type .extras, "+e.extras))}function Ai(a,e,t){let n=!1,r=!1,i=!1;for(let l=0,f=e.length;l<f;l++){let d=e[l];if(d.POSITION!==void 0&&(n=!0),d.NORMAL!==void 0&&(r=!0),d.COLOR_0!==void 0&&(i=!0),n&&r&&i)break}if(!n&&!r&&!i)return Promise.resolve(a);let o=[],s=[],c=[];for(let l=0,f=e.length;l<f;l++){let d=e[l];if(n){let u=d.POSITION!==void 0?t.getDependency("accessor",d.POSITION):a.attributes.position;o.push(u)}if(r){let u=d.NORMAL!==void 0?t.getDependency("accessor",d.NORMAL):a.attributes.normal;s.push(u)}if(i){let u=d.COLOR_0!==void 0?t.getDependency("accessor",d.COLOR_0):a.attributes.color;c.push(u)}}return Promise.all([Promise.all(o),Promise.all(s),Promise.all(c)]).then(function(l){let f=l[0],d=l[1],u=l[2];return n&&(a.morphAttributes.position=f),r&&(a.morphAttributes.normal=d),i&&(a.morphAttributes.color=u),a.morphTargetsRelative=!0,a})}function Ni(a,e){if(a.updateMorphTargets(),e.weights!==void 0)for(let t=0,n=e.weights.length;t<n;t++)a.morphTargetInfluences[t]=e.weights[t];if(e.extras&&Array.isArray(e.extras.targetNames)){let t=e.extras.targetNames;if(a.morphTargetInfluences.length===t.length){a.morphTargetDictionary={};for(let n=0,r=t.length;n<r;n++)a.morphTargetDictionary[t[n]]=n}else console.warn("THREE.GLTFLoader: Invalid extras.targetNames length. Ignoring names.")}}function Ii(a){let e,t=a.extensions&&a.extensions[_.KHR_DRACO_MESH_COMPRESSION];if(t?e="draco:"+t.bufferView+":"+t.indices+":"+kt(t.attributes):e=a.indices+":"+kt(a.attributes)+":"+a.mode,a.targets!==void 0)for(let n=0,r=a.targets.length;n<r;n++)e+=":"+kt(a.targets[n]);return e}function kt(a){let e="",t=Object.keys(a).sort();for(let n=0,r=t.length;n<r;n++)e+=t[n]+":"+a[t[n]]+";";return e}function un(a){switch(a){case Int8Array:return 1/127;case Uint8Array:return 1/255;case Int16Array:return 1/32767;case Uint16Array:return 1/65535;default:throw new Error("THREE.GLTFLoader: Unsupported normalized accessor component type.")}}function wi(a){return a.search(/\.jpe?g($|\?)/i)>0||a.search(/^data\:image\/jpeg/)===0?"image/jpeg":a.search(/\.webp($|\?)/i)>0||a.search(/^data\:image\/webp/)===0?"image/webp":a.search(/\.ktx2($|\?)/i)>0||a.search(/^data\:image\/ktx2/)===0?"image/ktx2":"image/png"}var Ri=new Re,hn=class{constructor(e={},t={}){this.json=e,this.extensions={},this.plugins={},this.options=t,this.cache=new Mi,this.associations=new Map,this.primitiveCache={},this.nodeCache={},this.meshCache={refs:{},uses:{}},this.cameraCache={refs:{},uses:{}},this.lightCache={refs:{},uses:{}},this.sourceCache={},this.textureCache={},this.nodeNamesUsed={};let n=!1,r=-1,i=!1,o=-1;if(typeof navigator<"u"&&typeof navigator.userAgent<"u"){let s=navigator.userAgent;n=/^((?!chrome|android).)*safari/i.test(s)===!0;let c=s.match(/Version\/(\d+)/);r=n&&c?parseInt(c[1],10):-1,i=s.indexOf("Firefox")>-1,o=i?s.match(/Firefox\/([0-9]+)\./)[1]:-1}typeof createImageBitmap>"u"||n&&r<17||i&&o<98?(this.textureLoader=new ne(this.options.manager),this.textureLoader.setPriority(this.options.priority),this.textureLoader.setCache(this.options.cache)):(this.textureLoader=new we(this.options.manager),this.textureLoader.setPriority(this.options.priority),this.textureLoader.setCache(this.options.cache)),this.textureLoader.setCrossOrigin(this.options.crossOrigin),this.textureLoader.setWithCredentials(this.options.withCredentials),this.textureLoader.setRequestHeader(this.options.requestHeader),this.fileLoader=new fe(this.options.manager),this.fileLoader.setPriority(this.options.priority),this.fileLoader.setCache(this.options.cache),this.fileLoader.setResponseType("arraybuffer"),(this.options.withCredentials||this.options.crossOrigin==="use-credentials")&&this.fileLoader.setWithCredentials(!0)}setExtensions(e){this.extensions=e}setPlugins(e){this.plugins=e}parse(e,t){let n=this,r=this.json,i=this.extensions;this.cache.removeAll(),this.nodeCache={},this._invokeAll(function(o){return o._markDefs&&o._markDefs()}),Promise.all(this._invokeAll(function(o){return o.beforeRoot&&o.beforeRoot()})).then(function(){return Promise.all([n.getDependencies("scene"),n.getDependencies("animation"),n.getDependencies("camera")])}).then(function(o){let s={scene:o[0][r.scene||0],scenes:o[0],animations:o[1],cameras:o[2],asset:r.asset,parser:n,userData:{}};return ie(i,s,r),V(s,r),Promise.all(n._invokeAll(function(c){return c.afterRoot&&c.afterRoot(s)})).then(function(){for(let c of s.scenes)c.updateMatrixWorld();e(s)})}).catch(t)}_markDefs(){let e=this.json.nodes||[],t=this.json.skins||[],n=this.json.meshes||[];for(let r=0,i=t.length;r<i;r++){let o=t[r].joints;for(let s=0,c=o.length;s<c;s++)e[o[s]].isBone=!0}for(let r=0,i=e.length;r<i;r++){let o=e[r];o.mesh!==void 0&&(this._addNodeRef(this.meshCache,o.mesh),o.skin!==void 0&&(n[o.mesh].isSkinnedMesh=!0)),o.camera!==void 0&&this._addNodeRef(this.cameraCache,o.camera)}}_addNodeRef(e,t){t!==void 0&&(e.refs[t]===void 0&&(e.refs[t]=e.uses[t]=0),e.refs[t]++)}_getNodeRef(e,t,n){if(e.refs[t]<=1)return n;let r=n.clone(),i=(o,s)=>{let c=this.associations.get(o);c!=null&&this.associations.set(s,c);for(let[l,f]of o.children.entries())i(f,s.children[l])};return i(n,r),r.name+="_instance_"+e.uses[t]++,r}_invokeOne(e){let t=Object.values(this.plugins);t.push(this);for(let n=0;n<t.length;n++){let r=e(t[n]);if(r)return r}return null}_invokeAll(e){let t=Object.values(this.plugins);t.unshift(this);let n=[];for(let r=0;r<t.length;r++){let i=e(t[r]);i&&n.push(i)}return n}getDependency(e,t){let n=e+":"+t,r=this.cache.get(n);if(!r){switch(e){case"scene":r=this.loadScene(t);break;case"node":r=this._invokeOne(function(i){return i.loadNode&&i.loadNode(t)});break;case"mesh":r=this._invokeOne(function(i){return i.loadMesh&&i.loadMesh(t)});break;case"accessor":r=this.loadAccessor(t);break;case"bufferView":r=this._invokeOne(function(i){return i.loadBufferView&&i.loadBufferView(t)});break;case"buffer":r=this.loadBuffer(t);break;case"material":r=this._invokeOne(function(i){return i.loadMaterial&&i.loadMaterial(t)});break;case"texture":r=this._invokeOne(function(i){return i.loadTexture&&i.loadTexture(t)});break;case"skin":r=this.loadSkin(t);break;case"animation":r=this._invokeOne(function(i){return i.loadAnimation&&i.loadAnimation(t)});break;case"camera":r=this.loadCamera(t);break;default:if(r=this._invokeOne(function(i){return i!=this&&i.getDependency&&i.getDependency(e,t)}),!r)throw new Error("Unknown type: "+e);break}this.cache.add(n,r)}return r}getDependencies(e){let t=this.cache.get(e);if(!t){let n=this,r=this.json[e+(e==="mesh"?"es":"s")]||[];t=Promise.all(r.map(function(i,o){return n.getDependency(e,o)})),this.cache.add(e,t)}return t}loadBuffer(e){let t=this.json.buffers[e],n=this.fileLoader;if(t.type&&t.type!=="arraybuffer")throw new Error("THREE.GLTFLoader: "+t.type+" buffer type is not supported.");if(t.uri===void 0&&e===0)return Promise.resolve(this.extensions[_.KHR_BINARY_GLTF].body);let r=this.options;return new Promise(function(i,o){n.load(pe.resolveURL(t.uri,r.path),i,void 0,function(){o(new Error('THREE.GLTFLoader: Failed to load buffer "'+t.uri+'".'))})})}loadBufferView(e){let t=this.json.bufferViews[e];return this.getDependency("buffer",t.buffer).then(function(n){let r=t.byteLength||0,i=t.byteOffset||0;return n.slice(i,i+r)})}loadAccessor(e){let t=this,n=this.json,r=this.json.accessors[e];if(r.bufferView===void 0&&r.sparse===void 0){let o=Ht[r.type],s=ge[r.componentType],c=r.normalized===!0,l=new s(r.count*o);return Promise.resolve(new re(l,o,c))}let i=[];return r.bufferView!==void 0?i.push(this.getDependency("bufferView",r.bufferView)):i.push(null),r.sparse!==void 0&&(i.push(this.getDependency("bufferView",r.sparse.indices.bufferView)),i.push(this.getDependency("bufferView",r.sparse.values.bufferView))),Promise.all(i).then(function(o){let s=o[0],c=Ht[r.type],l=ge[r.componentType],f=l.BYTES_PER_ELEMENT,d=f*c,u=r.byteOffset||0,h=r.bufferView!==void 0?n.bufferViews[r.bufferView].byteStride:void 0,p=r.normalized===!0,g,m;if(h&&h!==d){let v=Math.floor(u/h),y="InterleavedBuffer:"+r.bufferView+":"+r.componentType+":"+v+":"+r.count,M=t.cache.get(y);M||(g=new l(s,v*h,r.count*h/f),M=new ce(g,h/f),t.cache.add(y,M)),m=new le(M,c,u%h/f,p)}else s===null?g=new l(r.count*c):g=new l(s,u,r.count*c),m=new re(g,c,p);if(r.sparse!==void 0){let v=Ht.SCALAR,y=ge[r.sparse.indices.componentType],M=r.sparse.indices.byteOffset||0,S=r.sparse.values.byteOffset||0,x=new y(o[1],M,r.sparse.count*v),N=new l(o[2],S,r.sparse.count*c);s!==null&&(m=new re(m.array.slice(),m.itemSize,m.normalized)),m.normalized=!1;for(let T=0,w=x.length;T<w;T++){let oe=x[T];if(m.setX(oe,N[T*c]),c>=2&&m.setY(oe,N[T*c+1]),c>=3&&m.setZ(oe,N[T*c+2]),c>=4&&m.setW(oe,N[T*c+3]),c>=5)throw new Error("THREE.GLTFLoader: Unsupported itemSize in sparse BufferAttribute.")}m.normalized=p}return m})}loadTexture(e){let t=this.json,n=this.options,i=t.textures[e].source,o=t.images[i],s=this.textureLoader;if(o.uri){let c=n.manager.getHandler(o.uri);c!==null&&(s=c)}return this.loadTextureImage(e,i,s)}loadTextureImage(e,t,n){let r=this,i=this.json,o=i.textures[e],s=i.images[t],c=(s.uri||s.bufferView)+":"+o.sampler;if(this.textureCache[c])return this.textureCache[c];let l=this.loadImageSource(t,n).then(function(f){f.flipY=!1,f.name=o.name||s.name||"",f.name===""&&typeof s.uri=="string"&&s.uri.startsWith("data:image/")===!1&&(f.name=s.uri);let u=(i.samplers||{})[o.sampler]||{};return f.magFilter=Tr[u.magFilter]||Ue,f.minFilter=Tr[u.minFilter]||ht,f.wrapS=yr[u.wrapS]||De,f.wrapT=yr[u.wrapT]||De,f.generateMipmaps=!f.isCompressedTexture&&f.minFilter!==Dt&&f.minFilter!==Ue,r.associations.set(f,{textures:e}),f}).catch(function(){return null});return this.textureCache[c]=l,l}loadImageSource(e,t){let n=this,r=this.json,i=this.options;if(this.sourceCache[e]!==void 0)return this.sourceCache[e].then(u=>u.clone());let o=r.images[e],s=self.URL||self.webkitURL,c=o.uri||"",l=!1,f;if(t.isKTX2Loader===!0&&o.bufferView!==void 0)f=n.getDependency("bufferView",o.bufferView).then(function(u){return new Promise(function(h,p){t.parse(u,h,p)})});else{if(o.bufferView!==void 0)c=n.getDependency("bufferView",o.bufferView).then(function(u){l=!0;let h=new Blob([u],{type:o.mimeType});return c=s.createObjectURL(h),c});else if(o.uri===void 0)throw new Error("THREE.GLTFLoader: Image "+e+" is missing URI and bufferView");f=Promise.resolve(c).then(function(u){return new Promise(function(h,p){let g=h;t.isImageBitmapLoader===!0&&(g=function(m){let v=new Ot(m);v.needsUpdate=!0,h(v)}),t.load(pe.resolveURL(u,i.path),g,void 0,p)})})}let d=f.then(function(u){return l===!0&&s.revokeObjectURL(c),V(u,o),u.userData.mimeType=o.mimeType||wi(o.uri),u}).catch(function(u){throw console.error("THREE.GLTFLoader: Couldn't load texture",c),u});return this.sourceCache[e]=d,d}assignTexture(e,t,n,r){let i=this;return this.getDependency("texture",n.index).then(function(o){if(!o)return null;if(n.texCoord!==void 0&&n.texCoord>0&&(o=o.clone(),o.channel=n.texCoord),i.extensions[_.KHR_TEXTURE_TRANSFORM]){let s=n.extensions!==void 0?n.extensions[_.KHR_TEXTURE_TRANSFORM]:void 0;if(s){let c=i.associations.get(o);o=i.extensions[_.KHR_TEXTURE_TRANSFORM].extendTexture(o,s),i.associations.set(o,c)}}return r!==void 0&&(o.colorSpace=r),e[t]=o,o})}assignFinalMaterial(e){let t=e.geometry,n=e.material,r=t.attributes.tangent===void 0,i=t.attributes.color!==void 0,o=t.attributes.normal===void 0;if(e.isPoints){let s="PointsMaterial:"+n.uuid,c=this.cache.get(s);c||(c=new Ee,$e.prototype.copy.call(c,n),c.color.copy(n.color),c.map=n.map,c.sizeAttenuation=!1,this.cache.add(s,c)),n=c}else if(e.isLine){let s="LineBasicMaterial:"+n.uuid,c=this.cache.get(s);c||(c=new fr,$e.prototype.copy.call(c,n),c.color.copy(n.color),c.map=n.map,this.cache.add(s,c)),n=c}if(r||i||o){let s="ClonedMaterial:"+n.uuid+":";r&&(s+="derivative-tangents:"),i&&(s+="vertex-colors:"),o&&(s+="flat-shading:");let c=this.cache.get(s);c||(c=n.clone(),i&&(c.vertexColors=!0),o&&(c.flatShading=!0),r&&(c.normalScale&&(c.normalScale.y*=-1),c.clearcoatNormalScale&&(c.clearcoatNormalScale.y*=-1)),this.cache.add(s,c),this.associations.set(c,this.associations.get(n))),n=c}e.material=n}getMaterialType(){return Pt}loadMaterial(e){let t=this,n=this.json,r=this.extensions,i=n.materials[e],o,s={},c=i.extensions||{},l=[];if(c[_.KHR_MATERIALS_UNLIT]){let d=r[_.KHR_MATERIALS_UNLIT];o=d.getMaterialType(),l.push(d.extendParams(s,i,t))}else{let d=i.pbrMetallicRoughness||{};if(s.color=new Y(1,1,1),s.opacity=1,Array.isArray(d.baseColorFactor)){let u=d.baseColorFactor;s.color.setRGB(u[0],u[1],u[2],H),s.opacity=u[3]}d.baseColorTexture!==void 0&&l.push(t.assignTexture(s,"map",d.baseColorTexture,ae)),s.metalness=d.metallicFactor!==void 0?d.metallicFactor:1,s.roughness=d.roughnessFactor!==void 0?d.roughnessFactor:1,d.metallicRoughnessTexture!==void 0&&(l.push(t.assignTexture(s,"metalnessMap",d.metallicRoughnessTexture)),l.push(t.assignTexture(s,"roughnessMap",d.metallicRoughnessTexture))),o=this._invokeOne(function(u){return u.getMaterialType&&u.getMaterialType(e)}),l.push(Promise.all(this._invokeAll(function(u){return u.extendMaterialParams&&u.extendMaterialParams(e,s)})))}i.doubleSided===!0&&(s.side=sr);let f=i.alphaMode||Bt.OPAQUE;if(f===Bt.BLEND?(s.transparent=!0,s.depthWrite=!1):(s.transparent=!1,f===Bt.MASK&&(s.alphaTest=i.alphaCutoff!==void 0?i.alphaCutoff:.5)),i.normalTexture!==void 0&&o!==me&&(l.push(t.assignTexture(s,"normalMap",i.normalTexture)),s.normalScale=new Le(1,1),i.normalTexture.scale!==void 0)){let d=i.normalTexture.scale;s.normalScale.set(d,d)}if(i.occlusionTexture!==void 0&&o!==me&&(l.push(t.assignTexture(s,"aoMap",i.occlusionTexture)),i.occlusionTexture.strength!==void 0&&(s.aoMapIntensity=i.occlusionTexture.strength)),i.emissiveFactor!==void 0&&o!==me){let d=i.emissiveFactor;s.emissive=new Y().setRGB(d[0],d[1],d[2],H)}return i.emissiveTexture!==void 0&&o!==me&&l.push(t.assignTexture(s,"emissiveMap",i.emissiveTexture,ae)),Promise.all(l).then(function(){let d=new o(s);return i.name&&(d.name=i.name),V(d,i),t.associations.set(d,{materials:e}),i.extensions&&ie(r,d,i),d})}createUniqueName(e){let t=E.sanitizeNodeName(e||"");return t in this.nodeNamesUsed?t+"_"+ ++this.nodeNamesUsed[t]:(this.nodeNamesUsed[t]=0,t)}loadGeometries(e){let t=this,n=this.extensions,r=this.primitiveCache;function i(s){return n[_.KHR_DRACO_MESH_COMPRESSION].decodePrimitive(s,t).then(function(c){return Er(c,s,t)})}let o=[];for(let s=0,c=e.length;s<c;s++){let l=e[s],f=Ii(l),d=r[f];if(d)o.push(d.promise);else{let u;l.extensions&&l.extensions[_.KHR_DRACO_MESH_COMPRESSION]?u=i(l):u=Er(new Ye,l,t),l.mode===F.TRIANGLE_STRIP?u=u.then(h=>Ft(h,Fe)):l.mode===F.TRIANGLE_FAN&&(u=u.then(h=>Ft(h,ve))),r[f]={primitive:l,promise:u},o.push(u)}}return Promise.all(o)}loadMesh(e){let t=this,n=this.json,r=this.extensions,i=n.meshes[e],o=i.primitives,s=[];for(let c=0,l=o.length;c<l;c++){let f=o[c].material===void 0?Ei(this.cache):this.getDependency("material",o[c].material);s.push(f)}return s.push(t.loadGeometries(o)),Promise.all(s).then(async function(c){let l=c.slice(0,c.length-1),f=c[c.length-1],d=[];for(let h=0,p=f.length;h<p;h++){let g=f[h],m=o[h],v,y=l[h];if(m.mode===F.TRIANGLES||m.mode===F.TRIANGLE_STRIP||m.mode===F.TRIANGLE_FAN||m.mode===void 0){let M=i.isSkinnedMesh===!0,S=g.hasAttribute("skinIndex")&&g.hasAttribute("skinWeight");M&&S===!1&&console.warn("THREE.GLTFLoader: Missing skinIndex or skinWeight attributes. Skinning disabled."),v=M&&S?new Se(g,y):new hr(g,y),v.isSkinnedMesh===!0&&v.normalizeSkinWeights()}else if(m.mode===F.LINES)v=new dr(g,y);else if(m.mode===F.LINE_STRIP)v=new lr(g,y);else if(m.mode===F.LINE_LOOP)v=new ye(g,y);else if(m.mode===F.POINTS)v=new gr(g,y);else throw new Error("THREE.GLTFLoader: Primitive mode unsupported: "+m.mode);Object.keys(v.geometry.morphAttributes).length>0&&Ni(v,i),v.name=t.createUniqueName(i.name||"mesh_"+e),V(v,i),m.extensions&&ie(r,v,m),t.assignFinalMaterial(v),d.push(v)}for(let h=0,p=d.length;h<p;h++)t.associations.set(d[h],{meshes:e,primitives:h});if(d.length===1)return i.extensions&&ie(r,d[0],i),d[0];let u=new Ze;i.extensions&&ie(r,u,i),t.associations.set(u,{meshes:e});for(let h=0,p=d.length;h<p;h++)u.add(d[h]);return u})}loadCamera(e){let t,n=this.json.cameras[e],r=n[n.type];if(!r){console.warn("THREE.GLTFLoader: Missing camera parameters.");return}return n.type==="perspective"?t=new mr(Ct.radToDeg(r.yfov),r.aspectRatio||1,r.znear||1,r.zfar||2e6):n.type==="orthographic"&&(t=new pr(-r.xmag,r.xmag,r.ymag,-r.ymag,r.znear,r.zfar)),n.name&&(t.name=this.createUniqueName(n.name)),V(t,n),Promise.resolve(t)}loadSkin(e){let t=this.json.skins[e],n=[];for(let r=0,i=t.joints.length;r<i;r++)n.push(this._loadNodeShallow(t.joints[r]));return t.inverseBindMatrices!==void 0?n.push(this.getDependency("accessor",t.inverseBindMatrices)):n.push(null),Promise.all(n).then(function(r){let i=r.pop(),o=r,s=[],c=[];for(let l=0,f=o.length;l<f;l++){let d=o[l];if(d){s.push(d);let u=new Re;i!==null&&u.fromArray(i.array,l*16),c.push(u)}else console.warn('THREE.GLTFLoader: Joint "%s" could not be found.',t.joints[l])}return new Te(s,c)})}loadAnimation(e){let t=this.json,n=this,r=t.animations[e],i=r.name?r.name:"animation_"+e,o=[],s=[],c=[],l=[],f=[];for(let d=0,u=r.channels.length;d<u;d++){let h=r.channels[d],p=r.samplers[h.sampler],g=h.target,m=g.node,v=r.parameters!==void 0?r.parameters[p.input]:p.input,y=r.parameters!==void 0?r.parameters[p.output]:p.output;g.node!==void 0&&(o.push(this.getDependency("node",m)),s.push(this.getDependency("accessor",v)),c.push(this.getDependency("accessor",y)),l.push(p),f.push(g))}return Promise.all([Promise.all(o),Promise.all(s),Promise.all(c),Promise.all(l),Promise.all(f)]).then(function(d){let u=d[0],h=d[1],p=d[2],g=d[3],m=d[4],v=[];for(let M=0,S=u.length;M<S;M++){let x=u[M],N=h[M],T=p[M],w=g[M],oe=m[M];if(x===void 0)continue;x.updateMatrix&&x.updateMatrix();let nt=n._createAnimationTracks(x,N,T,w,oe);if(nt)for(let rt=0;rt<nt.length;rt++)v.push(nt[rt])}let y=new te(i,void 0,v);return V(y,r),y})}createNodeMesh(e){let t=this.json,n=this,r=t.nodes[e];return r.mesh===void 0?null:n.getDependency("mesh",r.mesh).then(function(i){let o=n._getNodeRef(n.meshCache,r.mesh,i);return r.weights!==void 0&&o.traverse(function(s){if(s.isMesh)for(let c=0,l=r.weights.length;c<l;c++)s.morphTargetInfluences[c]=r.weights[c]}),o})}loadNode(e){let t=this.json,n=this,r=t.nodes[e],i=n._loadNodeShallow(e),o=[],s=r.children||[];for(let l=0,f=s.length;l<f;l++)o.push(n.getDependency("node",s[l]));let c=r.skin===void 0?Promise.resolve(null):n.getDependency("skin",r.skin);return Promise.all([i,Promise.all(o),c]).then(function(l){let f=l[0],d=l[1],u=l[2];u!==null&&f.traverse(function(h){h.isSkinnedMesh&&h.bind(u,Ri)});for(let h=0,p=d.length;h<p;h++)f.add(d[h]);if(f.userData.pivot!==void 0&&d.length>0){let h=f.userData.pivot,p=d[0];f.pivot=new q().fromArray(h),f.position.x-=h[0],f.position.y-=h[1],f.position.z-=h[2],p.position.set(0,0,0),delete f.userData.pivot}return f})}_loadNodeShallow(e){let t=this.json,n=this.extensions,r=this;if(this.nodeCache[e]!==void 0)return this.nodeCache[e];let i=t.nodes[e],o=i.name?r.createUniqueName(i.name):"",s=[],c=r._invokeOne(function(l){return l.createNodeMesh&&l.createNodeMesh(e)});return c&&s.push(c),i.camera!==void 0&&s.push(r.getDependency("camera",i.camera).then(function(l){return r._getNodeRef(r.cameraCache,i.camera,l)})),r._invokeAll(function(l){return l.createNodeAttachment&&l.createNodeAttachment(e)}).forEach(function(l){s.push(l)}),this.nodeCache[e]=Promise.all(s).then(function(l){let f;if(i.isBone===!0?f=new Q:l.length>1?f=new Ze:l.length===1?f=l[0]:f=new be,f!==l[0])for(let d=0,u=l.length;d<u;d++)f.add(l[d]);if(i.name&&(f.userData.name=i.name,f.name=o),V(f,i),i.extensions&&ie(n,f,i),i.matrix!==void 0){let d=new Re;d.fromArray(i.matrix),f.applyMatrix4(d)}else i.translation!==void 0&&f.position.fromArray(i.translation),i.rotation!==void 0&&f.quaternion.fromArray(i.rotation),i.scale!==void 0&&f.scale.fromArray(i.scale);if(!r.associations.has(f))r.associations.set(f,{});else if(i.mesh!==void 0&&r.meshCache.refs[i.mesh]>1){let d=r.associations.get(f);r.associations.set(f,{...d})}return r.associations.get(f).nodes=e,f}),this.nodeCache[e]}loadScene(e){let t=this.extensions,n=this.json.scenes[e],r=this,i=new Ze;n.name&&(i.name=r.createUniqueName(n.name)),V(i,n),n.extensions&&ie(t,i,n);let o=n.nodes||[],s=[];for(let c=0,l=o.length;c<l;c++)s.push(r.getDependency("node",o[c]));return Promise.all(s).then(function(c){for(let f=0,d=c.length;f<d;f++){let u=c[f];u.parent!==null?i.add(Sr(u)):i.add(u)}let l=f=>{let d=new Map;for(let[u,h]of r.associations)(u instanceof $e||u instanceof Ot)&&d.set(u,h);return f.traverse(u=>{let h=r.associations.get(u);h!=null&&d.set(u,h)}),d};return r.associations=l(i),i})}_createAnimationTracks(e,t,n,r,i){let o=[],s=e.name?e.name:e.uuid,c=[];function l(h){h.morphTargetInfluences&&c.push(h.name?h.name:h.uuid)}Z[i.path]===Z.weights?(l(e),e.isGroup&&e.children.forEach(l)):c.push(s);let f;switch(Z[i.path]){case Z.weights:f=U;break;case Z.rotation:f=k;break;case Z.translation:case Z.scale:f=j;break;default:n.itemSize===1?f=U:f=j;break}let d=r.interpolation!==void 0?yi[r.interpolation]:J,u=this._getArrayFromAccessor(n);for(let h=0,p=c.length;h<p;h++){let g=new f(c[h]+"."+Z[i.path],t.array,u,d);r.interpolation==="CUBICSPLINE"&&this._createCubicSplineTrackInterpolant(g),o.push(g)}return o}_getArrayFromAccessor(e){let t=e.array;if(e.normalized){let n=un(t.constructor),r=new Float32Array(t.length);for(let i=0,o=t.length;i<o;i++)r[i]=t[i]*n;t=r}return t}_createCubicSplineTrackInterpolant(e){e.createInterpolant=function(n){let r=this instanceof k?fn:tt;return new r(this.times,this.values,this.getValueSize()/3,n)},e.createInterpolant.isInterpolantFactoryMethodGLTFCubicSpline=!0}};function bi(a,e,t){let n=e.attributes,r=new or;if(n.POSITION!==void 0){let s=t.json.accessors[n.POSITION],c=s.min,l=s.max;if(c!==void 0&&l!==void 0){if(r.set(new q(c[0],c[1],c[2]),new q(l[0],l[1],l[2])),s.normalized){let f=un(ge[s.componentType]);r.min.multiplyScalar(f),r.max.multiplyScalar(f)}}else{console.warn("THREE.GLTFLoader: Missing min/max properties for accessor POSITION.");return}}else return;let i=e.targets;if(i!==void 0){let s=new q,c=new q;for(let l=0,f=i.length;l<f;l++){let d=i[l];if(d.POSITION!==void 0){let u=t.json.accessors[d.POSITION],h=u.min,p=u.max;if(h!==void 0&&p!==void 0){if(c.setX(Math.max(Math.abs(h[0]),Math.abs(p[0]))),c.setY(Math.max(Math.abs(h[1]),Math.abs(p[1]))),c.setZ(Math.max(Math.abs(h[2]),Math.abs(p[2]))),u.normalized){let g=un(ge[u.componentType]);c.multiplyScalar(g)}s.max(c)}else console.warn("THREE.GLTFLoader: Missing min/max properties for accessor POSITION.")}}r.expandByVector(s)}a.boundingBox=r;let o=new _r;r.getCenter(o.center),o.radius=r.min.distanceTo(r.max)/2,a.boundingSphere=o}function Er(a,e,t){let n=e.attributes,r=[];function i(o,s){return t.getDependency("accessor",o).then(function(c){a.setAttribute(s,c)})}for(let o in n){let s=dn[o]||o.toLowerCase();s in a.attributes||r.push(i(n[o],s))}if(e.indices!==void 0&&!a.index){let o=t.getDependency("accessor",e.indices).then(function(s){a.setIndex(s)});r.push(o)}return Lt.workingColorSpace!==H&&"COLOR_0"in n&&console.warn(`THREE.GLTFLoader: Converting vertex colors from "srgb-linear" to "${Lt.workingColorSpace}" not supported.`),V(a,e),bi(a,e,t),Promise.all(r).then(function(){return e.targets!==void 0?Ai(a,e.targets,t):a})}var G="ATH_motion",pn="_ATH_VERTEX",Nr=a=>Number.isSafeInteger(a)&&a>=0;function mn(a){let e=a.extensions?.[G]?.motions;return Array.isArray(e)?e:[]}function Pe(a){return a.extensions?.[G]??null}function Ir(a,e){return(a.meshes??[]).flatMap(({primitives:t},n)=>t.map((r,i)=>({mesh:n,primitive:i,attributes:r.attributes,reference:Pe(r)})).filter(({reference:r})=>r?.motion===e))}function wr(a,e,t=null){let n=e.firstVertex??0;if(!Nr(n))throw new RangeError(`firstVertex: got ${n}, expected a whole number`);let r=Array.from({length:a},(o,s)=>t?t(s):n+s),i=r.find(o=>!Nr(o)||o>4294967295);if(i!==void 0)throw new RangeError(`vertices: got ${i}, expected whole numbers of vertices`);return Uint32Array.from(r)}function Rr(a){let e=a.reduce((i,{vertices:o})=>i+o.length,0),t=0;for(let{vertices:i}of a)for(let o of i)o>=t&&(t=o+1);if(t===0||t>e)throw new RangeError(`vertices: got ${t} of the motion, expected 1 to ${e}, those in primitives`);let n=new Float32Array(3*t).fill(NaN);for(let{vertices:i,positions:o}of a)i.forEach((s,c)=>{for(let l=0;l<3;l++)n[3*s+l]=o[3*c+l]});let r=n.findIndex(i=>!Number.isFinite(i));if(r>=0)throw new RangeError(`POSITION: got none for vertex ${Math.floor(r/3)} of the motion`);return n}function br(a,e){let t=(a.clips??[]).find(n=>n.name===e)?.start;return Number.isFinite(t)?t:0}function Lr(a,{duration:e}){let t=Math.max(a,0);return e>t-a?[[t,t-a],[a+e,e]]:[[t,0]]}function Cr(a,e){let t=i=>a.meshes[i]?.primitives.some(o=>e.has(Pe(o)?.motion)),n=new Set((a.nodes??[]).flatMap(({mesh:i},o)=>i!==void 0&&t(i)?[o]:[]));for(let i of n){delete a.nodes[i].skin,delete a.nodes[i].weights;let o=a.meshes[a.nodes[i].mesh];delete o.weights,delete o.extras?.targetNames;for(let s of o.primitives)delete s.targets}let r=({target:i})=>i.path!=="weights"||!n.has(i.node);return a.animations&&=a.animations.map(i=>({...i,channels:i.channels.filter(r)})).filter(({channels:i})=>i.length>0),n}var Li=new Le;function Dr(a){return e=>new vn(e,a)}var gn=class extends be{fade=.2;#e;#n;#t;constructor(e){super(),this.#e=e,this.#n=e.clips.map(()=>0),this.#t=e.clips.map(()=>0);for(let{index:t}of e.clips)for(let[n,r]of[["seconds",this.#n],["weight",this.#t]])Object.defineProperty(this,`${n}${t}`,{get:()=>0,set:i=>{r[t]=i}})}apply(){let e=Math.max(...this.#t),t=this.#t.indexOf(e),n=this.#e;if(!(e>0))return;let r=this.#n[t]/e;n.clip.index!==t&&n.play(t,{at:r,fade:this.fade}),n.setTime(n.start+r)}tracks({index:e},t){return[new U(`${this.uuid}.seconds${e}`,t.map(([n])=>n),t.map(([,n])=>n)),new U(`${this.uuid}.weight${e}`,[t[0][0]],[1])]}},vn=class{name=G;#e=[];#n=new Map;#t=new Map;constructor(e,t){this.parser=e,this.loader=t}async beforeRoot(){let{json:e}=this.parser;this.#e=await Promise.all(mn(e).map((n,r)=>this.#r(n,r).catch(i=>(console.warn(`${G}: motion ${r} does not play: ${i.message}`),null))));let t=new Set(this.#e.flatMap((n,r)=>n?[r]:[]));for(let n of Cr(e,t))delete e.meshes[e.nodes[n].mesh].isSkinnedMesh}async#r(e,t){let n=await Promise.all(Ir(this.parser.json,t).map(f=>this.#i(f))),r=Rr(n),i=await this.parser.getDependency("bufferView",e.bufferView),o=this.loader.hostMesh,s=this.loader.setHostMesh(r).parseAsync(i);this.loader.setHostMesh(o);let c=await s;if(c.motion.info.vertexCount!==r.length/3)throw c.dispose(),new RangeError(`vertices: got ${r.length/3} in primitives, expected ${c.motion.info.vertexCount}`);c.motion.wrap="marked";let l=Object.assign(new gn(c.motion),{name:`${G} ${t}`});return{ath:c,clock:l,vertices:new Map(n.map(({key:f,vertices:d})=>[f,d]))}}async#i({mesh:e,primitive:t,attributes:n,reference:r}){let[i,o]=await Promise.all([n.POSITION,n[pn]].map(s=>s===void 0?null:this.parser.getDependency("accessor",s)));return{key:`${e} ${t}`,vertices:wr(i.count,r,o&&(s=>o.getX(s))),positions:Ur(i).array}}loadMesh(e){let{primitives:t}=this.parser.json.meshes[e];return t.some(n=>this.#e[Pe(n)?.motion])?this.parser.loadMesh(e).then(n=>((n.isGroup?n.children:[n]).forEach((i,o)=>{let s=Pe(t[o]);this.#e[s?.motion]&&(i.userData[G]={...s,key:`${e} ${o}`})}),n)):null}afterRoot(e){for(let t of e.scenes)t.traverse(n=>{n.userData[G]&&this.#a(n)});this.#e.forEach((t,n)=>{if(t){e.scene.add(t.clock);for(let r of t.ath.motion.clips)this.#o(e.animations,t,r,mn(this.parser.json)[n])}}),e.userData[G]=this.#e.map(t=>t?.ath??null)}#o(e,{clock:t},n,r){let i=t.tracks(n,Lr(br(r,n.name),n)),o=e.find(({name:s})=>s===n.name);o?(o.tracks.push(...i),o.resetDuration()):e.push(new te(n.name,-1,i))}#a(e){let{motion:t,key:n}=e.userData[G],{ath:r,clock:i,vertices:o}=this.#e[t];e.geometry=Pr(this.#n,n,()=>r.motion.attach(Ci(e.geometry,o.get(n)))),e.material=Pr(this.#t,`${t} ${e.material.uuid}`,()=>this.#s(e.material,r)),r.motion.bindShadows(e),e.onBeforeRender=(s,c,l)=>{r.motion.update(l,s.getDrawingBufferSize(Li).y,e),i.apply()}}#s(e,{motion:t}){let n=e.clone();return this.parser.associations.has(e)&&this.parser.associations.set(n,this.parser.associations.get(e)),t.bind(n)}};function Pr(a,e,t){return a.has(e)||a.set(e,t()),a.get(e)}function Ur(a){if(!a.isInterleavedBufferAttribute&&a.array instanceof Float32Array)return a;let e=Float32Array.from({length:3*a.count},(t,n)=>a.getComponent(Math.floor(n/3),n%3));return new re(e,3)}function Ci(a,e){let t=a.clone();for(let n of["skinIndex","skinWeight",pn.toLowerCase()])t.deleteAttribute(n);return t.setAttribute("position",Ur(t.getAttribute("position"))),t.userData.source=e,t}var Pi=a=>(a.textureLoader=new ne(a.options.manager),{name:"pictures"});async function bc(a,e){let t=await new Qe().register(Pi).register(Dr(e)).parseAsync(a,""),{scene:n,userData:{ATH_motion:r=[]}}=t,[i,...o]=r.filter(Boolean);if(!i)throw Object.assign(new Error("ATH_motion: got none that plays in the GLB, expected one"),{codeName:"NO_MOTION"});for(let s of n.children.filter(({apply:c})=>c))s.removeFromParent();return Object.assign(i,{model:n,others:o,number:r.indexOf(i)})}export{bc as openModel};
