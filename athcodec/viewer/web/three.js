var md={LEFT:0,MIDDLE:1,RIGHT:2,ROTATE:0,DOLLY:1,PAN:2},gd={ROTATE:0,PAN:1,DOLLY_PAN:2,DOLLY_ROTATE:3},il=0,Qs=1,nl=2;var nn=1,rl=2,rn=3,li=0,at=1,Wt=2,Gi=0,zi=1,js=2,ea=3,ta=4,ol=5;var Hi=100,sl=101,al=102,ll=103,cl=104,fl=200,ul=201,hl=202,dl=203,xo=204,So=205,pl=206,ml=207,gl=208,_l=209,xl=210,Sl=211,Ml=212,vl=213,El=214,ur=0,hr=1,dr=2,Vi=3,pr=4,mr=5,gr=6,_r=7,xn=0,Tl=1,yl=2,Xt=0,Mo=1,vo=2,Eo=3,xr=4,To=5,yo=6,Ao=7;var ia=300,on=301,Sr=302,bo=303,Ro=304,Mr=1e3,qt=1001,vr=1002,et=1003,Al=1004;var Er=1005;var ft=1006,wo=1007;var pi=1008;var Tt=1009,Co=1010,Po=1011,wi=1012,Sn=1013,Dt=1014,ut=1015,It=1016,Mn=1017,vn=1018,Ci=1020,Lo=35902,Do=35899,Io=1021,Uo=1022,Yt=1023,ci=1026,mi=1027,En=1028,Tn=1029,jt=1030,yn=1031;var An=1033,bn=33776,Rn=33777,wn=33778,Cn=33779,Tr=35840,yr=35841,Ar=35842,br=35843,Rr=36196,wr=37492,Cr=37496,Pr=37488,Lr=37489,sn=37490,Dr=37491,Ir=37808,Ur=37809,Nr=37810,Fr=37811,Or=37812,Br=37813,Gr=37814,zr=37815,Hr=37816,Vr=37817,kr=37818,Wr=37819,Xr=37820,qr=37821,Yr=36492,Zr=36494,Kr=36495,Jr=36283,$r=36284,an=36285,Qr=36286;var bl=3200,_d=3201;var ln=0,Rl=1,fi="",Ht="srgb",jr="srgb-linear",cn="linear",ze="srgb";var No=7680;var wl=519,Cl=512,Pl=513,Ll=514,Fo=515,Dl=516,Il=517,Oo=518,Bo=519,Ul=35044,xd=35048;var na="300 es",wt=2e3,Pi=2001;function Fl(n){for(let e=n.length-1;e>=0;--e)if(n[e]>=65535)return!0;return!1}function Ln(n){return document.createElementNS("http://www.w3.org/1999/xhtml",n)}function Ol(){let n=Ln("canvas");return n.style.display="block",n}var Nl={},Pn=null;function ra(...n){let e="THREE."+n.shift();Pn?Pn("log",e,...n):console.log(e,...n)}function Bl(n){let e=n[0];if(typeof e=="string"&&e.startsWith("TSL:")){let t=n[1];t&&t.isStackTrace?n[0]+=" "+t.getLocation():n[1]='Stack trace not available. Enable "THREE.Node.captureStackTrace" to capture stack traces.'}return n}function pe(...n){n=Bl(n);let e="THREE."+n.shift();if(Pn)Pn("warn",e,...n);else{let t=n[0];t&&t.isStackTrace?console.warn(t.getError(e)):console.warn(e,...n)}}function Oe(...n){n=Bl(n);let e="THREE."+n.shift();if(Pn)Pn("error",e,...n);else{let t=n[0];t&&t.isStackTrace?console.error(t.getError(e)):console.error(e,...n)}}function fn(...n){let e=n.join(" ");e in Nl||(Nl[e]=!0,pe(...n))}function Gl(n,e,t){return new Promise(function(i,r){function o(){switch(n.clientWaitSync(e,n.SYNC_FLUSH_COMMANDS_BIT,0)){case n.WAIT_FAILED:r();break;case n.TIMEOUT_EXPIRED:setTimeout(o,t);break;default:i()}}setTimeout(o,t)})}var zl={[ur]:ur,[dr]:gr,[pr]:pr,[Vi]:mr,[hr]:hr,[gr]:dr,[_r]:_r,[mr]:Vi};var yt=class{addEventListener(e,t){this._listeners===void 0&&(this._listeners={});let i=this._listeners;i[e]===void 0&&(i[e]=[]),i[e].indexOf(t)===-1&&i[e].push(t)}hasEventListener(e,t){let i=this._listeners;return i===void 0?!1:i[e]!==void 0&&i[e].indexOf(t)!==-1}removeEventListener(e,t){let i=this._listeners;if(i===void 0)return;let r=i[e];if(r!==void 0){let o=r.indexOf(t);o!==-1&&r.splice(o,1)}}dispatchEvent(e){let t=this._listeners;if(t===void 0)return;let i=t[e.type];if(i!==void 0){e.target=this;let r=i.slice(0);for(let o=0,s=r.length;o<s;o++)r[o].call(this,e);e.target=null}}};var Ut=["00","01","02","03","04","05","06","07","08","09","0a","0b","0c","0d","0e","0f","10","11","12","13","14","15","16","17","18","19","1a","1b","1c","1d","1e","1f","20","21","22","23","24","25","26","27","28","29","2a","2b","2c","2d","2e","2f","30","31","32","33","34","35","36","37","38","39","3a","3b","3c","3d","3e","3f","40","41","42","43","44","45","46","47","48","49","4a","4b","4c","4d","4e","4f","50","51","52","53","54","55","56","57","58","59","5a","5b","5c","5d","5e","5f","60","61","62","63","64","65","66","67","68","69","6a","6b","6c","6d","6e","6f","70","71","72","73","74","75","76","77","78","79","7a","7b","7c","7d","7e","7f","80","81","82","83","84","85","86","87","88","89","8a","8b","8c","8d","8e","8f","90","91","92","93","94","95","96","97","98","99","9a","9b","9c","9d","9e","9f","a0","a1","a2","a3","a4","a5","a6","a7","a8","a9","aa","ab","ac","ad","ae","af","b0","b1","b2","b3","b4","b5","b6","b7","b8","b9","ba","bb","bc","bd","be","bf","c0","c1","c2","c3","c4","c5","c6","c7","c8","c9","ca","cb","cc","cd","ce","cf","d0","d1","d2","d3","d4","d5","d6","d7","d8","d9","da","db","dc","dd","de","df","e0","e1","e2","e3","e4","e5","e6","e7","e8","e9","ea","eb","ec","ed","ee","ef","f0","f1","f2","f3","f4","f5","f6","f7","f8","f9","fa","fb","fc","fd","fe","ff"],Hl=1234567,Dn=Math.PI/180,eo=180/Math.PI;function gi(){let n=Math.random()*4294967295|0,e=Math.random()*4294967295|0,t=Math.random()*4294967295|0,i=Math.random()*4294967295|0;return(Ut[n&255]+Ut[n>>8&255]+Ut[n>>16&255]+Ut[n>>24&255]+"-"+Ut[e&255]+Ut[e>>8&255]+"-"+Ut[e>>16&15|64]+Ut[e>>24&255]+"-"+Ut[t&63|128]+Ut[t>>8&255]+"-"+Ut[t>>16&255]+Ut[t>>24&255]+Ut[i&255]+Ut[i>>8&255]+Ut[i>>16&255]+Ut[i>>24&255]).toLowerCase()}function Pe(n,e,t){return Math.max(e,Math.min(t,n))}function Go(n,e){return(n%e+e)%e}function Sd(n,e,t,i,r){return i+(n-e)*(r-i)/(t-e)}function Md(n,e,t){return n!==e?(t-n)/(e-n):0}function In(n,e,t){return(1-t)*n+t*e}function vd(n,e,t,i){return In(n,e,1-Math.exp(-t*i))}function Ed(n,e=1){return e-Math.abs(Go(n,e*2)-e)}function Td(n,e,t){return n<=e?0:n>=t?1:(n=(n-e)/(t-e),n*n*(3-2*n))}function yd(n,e,t){return n<=e?0:n>=t?1:(n=(n-e)/(t-e),n*n*n*(n*(n*6-15)+10))}function Ad(n,e){return n+Math.floor(Math.random()*(e-n+1))}function bd(n,e){return n+Math.random()*(e-n)}function Rd(n){return n*(.5-Math.random())}function wd(n){n!==void 0&&(Hl=n);let e=Hl+=1831565813;return e=Math.imul(e^e>>>15,e|1),e^=e+Math.imul(e^e>>>7,e|61),((e^e>>>14)>>>0)/4294967296}function Cd(n){return n*Dn}function Pd(n){return n*eo}function Ld(n){return n>0&&Number.isInteger(n)&&2**Math.round(Math.log2(n))===n}function Dd(n){return Math.pow(2,Math.ceil(Math.log(n)/Math.LN2))}function Id(n){return Math.pow(2,Math.floor(Math.log(n)/Math.LN2))}function Ud(n,e,t,i,r){let o=Math.cos,s=Math.sin,a=o(t/2),c=s(t/2),l=o((e+i)/2),f=s((e+i)/2),d=o((e-i)/2),h=s((e-i)/2),m=o((i-e)/2),x=s((i-e)/2);switch(r){case"XYX":n.set(a*f,c*d,c*h,a*l);break;case"YZY":n.set(c*h,a*f,c*d,a*l);break;case"ZXZ":n.set(c*d,c*h,a*f,a*l);break;case"XZX":n.set(a*f,c*x,c*m,a*l);break;case"YXY":n.set(c*m,a*f,c*x,a*l);break;case"ZYZ":n.set(c*x,c*m,a*f,a*l);break;default:pe("MathUtils: .setQuaternionFromProperEuler() encountered an unknown order: "+r)}}function zo(n){switch(n.constructor){case Uint32Array:return 4294967295;case Uint16Array:return 65535;case Uint8Array:case Uint8ClampedArray:return 255;case Int32Array:return 2147483647;case Int16Array:return 32767;case Int8Array:return 127;default:return}}function oa(n,e){if(e.constructor===Float32Array)return n;let t=zo(e);if(t===void 0)throw new Error("THREE.MathUtils: Invalid component type.");return Math.max(n/t,-1)}function sa(n,e){if(e.constructor===Float32Array)return n;let t=zo(e);if(t===void 0)throw new Error("THREE.MathUtils: Invalid component type.");return Math.round(n*t)}var Vl={DEG2RAD:Dn,RAD2DEG:eo,generateUUID:gi,clamp:Pe,euclideanModulo:Go,mapLinear:Sd,inverseLerp:Md,lerp:In,damp:vd,pingpong:Ed,smoothstep:Td,smootherstep:yd,randInt:Ad,randFloat:bd,randFloatSpread:Rd,seededRandom:wd,degToRad:Cd,radToDeg:Pd,isPowerOfTwo:Ld,ceilPowerOfTwo:Dd,floorPowerOfTwo:Id,setQuaternionFromProperEuler:Ud,normalize:sa,denormalize:oa};var ye=class{static{this.prototype.isVector2=!0}constructor(e=0,t=0){this.x=e,this.y=t}get width(){return this.x}set width(e){this.x=e}get height(){return this.y}set height(e){this.y=e}set(e,t){return this.x=e,this.y=t,this}setScalar(e){return this.x=e,this.y=e,this}setX(e){return this.x=e,this}setY(e){return this.y=e,this}setComponent(e,t){switch(e){case 0:this.x=t;break;case 1:this.y=t;break;default:throw new Error("THREE.Vector2: index is out of range: "+e)}return this}getComponent(e){switch(e){case 0:return this.x;case 1:return this.y;default:throw new Error("THREE.Vector2: index is out of range: "+e)}}clone(){return new this.constructor(this.x,this.y)}copy(e){return this.x=e.x,this.y=e.y,this}add(e){return this.x+=e.x,this.y+=e.y,this}addScalar(e){return this.x+=e,this.y+=e,this}addVectors(e,t){return this.x=e.x+t.x,this.y=e.y+t.y,this}addScaledVector(e,t){return this.x+=e.x*t,this.y+=e.y*t,this}sub(e){return this.x-=e.x,this.y-=e.y,this}subScalar(e){return this.x-=e,this.y-=e,this}subVectors(e,t){return this.x=e.x-t.x,this.y=e.y-t.y,this}multiply(e){return this.x*=e.x,this.y*=e.y,this}multiplyScalar(e){return this.x*=e,this.y*=e,this}divide(e){return this.x/=e.x,this.y/=e.y,this}divideScalar(e){return this.multiplyScalar(1/e)}applyMatrix3(e){let t=this.x,i=this.y,r=e.elements;return this.x=r[0]*t+r[3]*i+r[6],this.y=r[1]*t+r[4]*i+r[7],this}min(e){return this.x=Math.min(this.x,e.x),this.y=Math.min(this.y,e.y),this}max(e){return this.x=Math.max(this.x,e.x),this.y=Math.max(this.y,e.y),this}clamp(e,t){return this.x=Pe(this.x,e.x,t.x),this.y=Pe(this.y,e.y,t.y),this}clampScalar(e,t){return this.x=Pe(this.x,e,t),this.y=Pe(this.y,e,t),this}clampLength(e,t){let i=this.length();return this.divideScalar(i||1).multiplyScalar(Pe(i,e,t))}floor(){return this.x=Math.floor(this.x),this.y=Math.floor(this.y),this}ceil(){return this.x=Math.ceil(this.x),this.y=Math.ceil(this.y),this}round(){return this.x=Math.round(this.x),this.y=Math.round(this.y),this}roundToZero(){return this.x=Math.trunc(this.x),this.y=Math.trunc(this.y),this}negate(){return this.x=-this.x,this.y=-this.y,this}dot(e){return this.x*e.x+this.y*e.y}cross(e){return this.x*e.y-this.y*e.x}lengthSq(){return this.x*this.x+this.y*this.y}length(){return Math.sqrt(this.x*this.x+this.y*this.y)}manhattanLength(){return Math.abs(this.x)+Math.abs(this.y)}normalize(){return this.divideScalar(this.length()||1)}angle(){return Math.atan2(-this.y,-this.x)+Math.PI}angleTo(e){let t=Math.sqrt(this.lengthSq()*e.lengthSq());if(t===0)return Math.PI/2;let i=this.dot(e)/t;return Math.acos(Pe(i,-1,1))}distanceTo(e){return Math.sqrt(this.distanceToSquared(e))}distanceToSquared(e){let t=this.x-e.x,i=this.y-e.y;return t*t+i*i}manhattanDistanceTo(e){return Math.abs(this.x-e.x)+Math.abs(this.y-e.y)}setLength(e){return this.normalize().multiplyScalar(e)}lerp(e,t){return this.x+=(e.x-this.x)*t,this.y+=(e.y-this.y)*t,this}lerpVectors(e,t,i){return this.x=e.x+(t.x-e.x)*i,this.y=e.y+(t.y-e.y)*i,this}equals(e){return e.x===this.x&&e.y===this.y}fromArray(e,t=0){return this.x=e[t],this.y=e[t+1],this}toArray(e=[],t=0){return e[t]=this.x,e[t+1]=this.y,e}fromBufferAttribute(e,t){return this.x=e.getX(t),this.y=e.getY(t),this}rotateAround(e,t){let i=Math.cos(t),r=Math.sin(t),o=this.x-e.x,s=this.y-e.y;return this.x=o*i-s*r+e.x,this.y=o*r+s*i+e.y,this}random(){return this.x=Math.random(),this.y=Math.random(),this}*[Symbol.iterator](){yield this.x,yield this.y}};var Zt=class{constructor(e=0,t=0,i=0,r=1){this.isQuaternion=!0,this._x=e,this._y=t,this._z=i,this._w=r}static slerpFlat(e,t,i,r,o,s,a){let c=i[r+0],l=i[r+1],f=i[r+2],d=i[r+3],h=o[s+0],m=o[s+1],x=o[s+2],v=o[s+3];if(d!==v||c!==h||l!==m||f!==x){let p=c*h+l*m+f*x+d*v;p<0&&(h=-h,m=-m,x=-x,v=-v,p=-p);let u=1-a;if(p<.9995){let y=Math.acos(p),A=Math.sin(y);u=Math.sin(u*y)/A,a=Math.sin(a*y)/A,c=c*u+h*a,l=l*u+m*a,f=f*u+x*a,d=d*u+v*a}else{c=c*u+h*a,l=l*u+m*a,f=f*u+x*a,d=d*u+v*a;let y=1/Math.sqrt(c*c+l*l+f*f+d*d);c*=y,l*=y,f*=y,d*=y}}e[t]=c,e[t+1]=l,e[t+2]=f,e[t+3]=d}static multiplyQuaternionsFlat(e,t,i,r,o,s){let a=i[r],c=i[r+1],l=i[r+2],f=i[r+3],d=o[s],h=o[s+1],m=o[s+2],x=o[s+3];return e[t]=a*x+f*d+c*m-l*h,e[t+1]=c*x+f*h+l*d-a*m,e[t+2]=l*x+f*m+a*h-c*d,e[t+3]=f*x-a*d-c*h-l*m,e}get x(){return this._x}set x(e){this._x=e,this._onChangeCallback()}get y(){return this._y}set y(e){this._y=e,this._onChangeCallback()}get z(){return this._z}set z(e){this._z=e,this._onChangeCallback()}get w(){return this._w}set w(e){this._w=e,this._onChangeCallback()}set(e,t,i,r){return this._x=e,this._y=t,this._z=i,this._w=r,this._onChangeCallback(),this}clone(){return new this.constructor(this._x,this._y,this._z,this._w)}copy(e){return this._x=e.x,this._y=e.y,this._z=e.z,this._w=e.w,this._onChangeCallback(),this}setFromEuler(e,t=!0){let i=e._x,r=e._y,o=e._z,s=e._order,a=Math.cos,c=Math.sin,l=a(i/2),f=a(r/2),d=a(o/2),h=c(i/2),m=c(r/2),x=c(o/2);switch(s){case"XYZ":this._x=h*f*d+l*m*x,this._y=l*m*d-h*f*x,this._z=l*f*x+h*m*d,this._w=l*f*d-h*m*x;break;case"YXZ":this._x=h*f*d+l*m*x,this._y=l*m*d-h*f*x,this._z=l*f*x-h*m*d,this._w=l*f*d+h*m*x;break;case"ZXY":this._x=h*f*d-l*m*x,this._y=l*m*d+h*f*x,this._z=l*f*x+h*m*d,this._w=l*f*d-h*m*x;break;case"ZYX":this._x=h*f*d-l*m*x,this._y=l*m*d+h*f*x,this._z=l*f*x-h*m*d,this._w=l*f*d+h*m*x;break;case"YZX":this._x=h*f*d+l*m*x,this._y=l*m*d+h*f*x,this._z=l*f*x-h*m*d,this._w=l*f*d-h*m*x;break;case"XZY":this._x=h*f*d-l*m*x,this._y=l*m*d-h*f*x,this._z=l*f*x+h*m*d,this._w=l*f*d+h*m*x;break;default:pe("Quaternion: .setFromEuler() encountered an unknown order: "+s)}return t===!0&&this._onChangeCallback(),this}setFromAxisAngle(e,t){let i=t/2,r=Math.sin(i);return this._x=e.x*r,this._y=e.y*r,this._z=e.z*r,this._w=Math.cos(i),this._onChangeCallback(),this}setFromRotationMatrix(e){let t=e.elements,i=t[0],r=t[4],o=t[8],s=t[1],a=t[5],c=t[9],l=t[2],f=t[6],d=t[10],h=i+a+d;if(h>0){let m=.5/Math.sqrt(h+1);this._w=.25/m,this._x=(f-c)*m,this._y=(o-l)*m,this._z=(s-r)*m}else if(i>a&&i>d){let m=2*Math.sqrt(1+i-a-d);this._w=(f-c)/m,this._x=.25*m,this._y=(r+s)/m,this._z=(o+l)/m}else if(a>d){let m=2*Math.sqrt(1+a-i-d);this._w=(o-l)/m,this._x=(r+s)/m,this._y=.25*m,this._z=(c+f)/m}else{let m=2*Math.sqrt(1+d-i-a);this._w=(s-r)/m,this._x=(o+l)/m,this._y=(c+f)/m,this._z=.25*m}return this._onChangeCallback(),this}setFromUnitVectors(e,t){let i=e.dot(t)+1;return i<1e-8?(i=0,Math.abs(e.x)>Math.abs(e.z)?(this._x=-e.y,this._y=e.x,this._z=0,this._w=i):(this._x=0,this._y=-e.z,this._z=e.y,this._w=i)):(this._x=e.y*t.z-e.z*t.y,this._y=e.z*t.x-e.x*t.z,this._z=e.x*t.y-e.y*t.x,this._w=i),this.normalize()}angleTo(e){return 2*Math.acos(Math.abs(Pe(this.dot(e),-1,1)))}rotateTowards(e,t){let i=this.angleTo(e);if(i===0)return this;let r=Math.min(1,t/i);return this.slerp(e,r),this}identity(){return this.set(0,0,0,1)}invert(){return this.conjugate()}conjugate(){return this._x*=-1,this._y*=-1,this._z*=-1,this._onChangeCallback(),this}dot(e){return this._x*e._x+this._y*e._y+this._z*e._z+this._w*e._w}lengthSq(){return this._x*this._x+this._y*this._y+this._z*this._z+this._w*this._w}length(){return Math.sqrt(this._x*this._x+this._y*this._y+this._z*this._z+this._w*this._w)}normalize(){let e=this.length();return e===0?(this._x=0,this._y=0,this._z=0,this._w=1):(e=1/e,this._x=this._x*e,this._y=this._y*e,this._z=this._z*e,this._w=this._w*e),this._onChangeCallback(),this}multiply(e){return this.multiplyQuaternions(this,e)}premultiply(e){return this.multiplyQuaternions(e,this)}multiplyQuaternions(e,t){let i=e._x,r=e._y,o=e._z,s=e._w,a=t._x,c=t._y,l=t._z,f=t._w;return this._x=i*f+s*a+r*l-o*c,this._y=r*f+s*c+o*a-i*l,this._z=o*f+s*l+i*c-r*a,this._w=s*f-i*a-r*c-o*l,this._onChangeCallback(),this}slerp(e,t){let i=e._x,r=e._y,o=e._z,s=e._w,a=this.dot(e);a<0&&(i=-i,r=-r,o=-o,s=-s,a=-a);let c=1-t;if(a<.9995){let l=Math.acos(a),f=Math.sin(l);c=Math.sin(c*l)/f,t=Math.sin(t*l)/f,this._x=this._x*c+i*t,this._y=this._y*c+r*t,this._z=this._z*c+o*t,this._w=this._w*c+s*t,this._onChangeCallback()}else this._x=this._x*c+i*t,this._y=this._y*c+r*t,this._z=this._z*c+o*t,this._w=this._w*c+s*t,this.normalize();return this}slerpQuaternions(e,t,i){return this.copy(e).slerp(t,i)}random(){let e=2*Math.PI*Math.random(),t=2*Math.PI*Math.random(),i=Math.random(),r=Math.sqrt(1-i),o=Math.sqrt(i);return this.set(r*Math.sin(e),r*Math.cos(e),o*Math.sin(t),o*Math.cos(t))}equals(e){return e._x===this._x&&e._y===this._y&&e._z===this._z&&e._w===this._w}fromArray(e,t=0){return this._x=e[t],this._y=e[t+1],this._z=e[t+2],this._w=e[t+3],this._onChangeCallback(),this}toArray(e=[],t=0){return e[t]=this._x,e[t+1]=this._y,e[t+2]=this._z,e[t+3]=this._w,e}fromBufferAttribute(e,t){return this._x=e.getX(t),this._y=e.getY(t),this._z=e.getZ(t),this._w=e.getW(t),this._onChangeCallback(),this}toJSON(){return this.toArray()}_onChange(e){return this._onChangeCallback=e,this}_onChangeCallback(){}*[Symbol.iterator](){yield this._x,yield this._y,yield this._z,yield this._w}};var I=class{static{this.prototype.isVector3=!0}constructor(e=0,t=0,i=0){this.x=e,this.y=t,this.z=i}set(e,t,i){return i===void 0&&(i=this.z),this.x=e,this.y=t,this.z=i,this}setScalar(e){return this.x=e,this.y=e,this.z=e,this}setX(e){return this.x=e,this}setY(e){return this.y=e,this}setZ(e){return this.z=e,this}setComponent(e,t){switch(e){case 0:this.x=t;break;case 1:this.y=t;break;case 2:this.z=t;break;default:throw new Error("THREE.Vector3: index is out of range: "+e)}return this}getComponent(e){switch(e){case 0:return this.x;case 1:return this.y;case 2:return this.z;default:throw new Error("THREE.Vector3: index is out of range: "+e)}}clone(){return new this.constructor(this.x,this.y,this.z)}copy(e){return this.x=e.x,this.y=e.y,this.z=e.z,this}add(e){return this.x+=e.x,this.y+=e.y,this.z+=e.z,this}addScalar(e){return this.x+=e,this.y+=e,this.z+=e,this}addVectors(e,t){return this.x=e.x+t.x,this.y=e.y+t.y,this.z=e.z+t.z,this}addScaledVector(e,t){return this.x+=e.x*t,this.y+=e.y*t,this.z+=e.z*t,this}sub(e){return this.x-=e.x,this.y-=e.y,this.z-=e.z,this}subScalar(e){return this.x-=e,this.y-=e,this.z-=e,this}subVectors(e,t){return this.x=e.x-t.x,this.y=e.y-t.y,this.z=e.z-t.z,this}multiply(e){return this.x*=e.x,this.y*=e.y,this.z*=e.z,this}multiplyScalar(e){return this.x*=e,this.y*=e,this.z*=e,this}multiplyVectors(e,t){return this.x=e.x*t.x,this.y=e.y*t.y,this.z=e.z*t.z,this}applyEuler(e){return this.applyQuaternion(kl.setFromEuler(e))}applyAxisAngle(e,t){return this.applyQuaternion(kl.setFromAxisAngle(e,t))}applyMatrix3(e){let t=this.x,i=this.y,r=this.z,o=e.elements;return this.x=o[0]*t+o[3]*i+o[6]*r,this.y=o[1]*t+o[4]*i+o[7]*r,this.z=o[2]*t+o[5]*i+o[8]*r,this}applyNormalMatrix(e){return this.applyMatrix3(e).normalize()}applyMatrix4(e){let t=this.x,i=this.y,r=this.z,o=e.elements,s=1/(o[3]*t+o[7]*i+o[11]*r+o[15]);return this.x=(o[0]*t+o[4]*i+o[8]*r+o[12])*s,this.y=(o[1]*t+o[5]*i+o[9]*r+o[13])*s,this.z=(o[2]*t+o[6]*i+o[10]*r+o[14])*s,this}applyQuaternion(e){let t=this.x,i=this.y,r=this.z,o=e.x,s=e.y,a=e.z,c=e.w,l=2*(s*r-a*i),f=2*(a*t-o*r),d=2*(o*i-s*t);return this.x=t+c*l+s*d-a*f,this.y=i+c*f+a*l-o*d,this.z=r+c*d+o*f-s*l,this}project(e){return this.applyMatrix4(e.matrixWorldInverse).applyMatrix4(e.projectionMatrix)}unproject(e){return this.applyMatrix4(e.projectionMatrixInverse).applyMatrix4(e.matrixWorld)}transformDirection(e){let t=this.x,i=this.y,r=this.z,o=e.elements;return this.x=o[0]*t+o[4]*i+o[8]*r,this.y=o[1]*t+o[5]*i+o[9]*r,this.z=o[2]*t+o[6]*i+o[10]*r,this.normalize()}divide(e){return this.x/=e.x,this.y/=e.y,this.z/=e.z,this}divideScalar(e){return this.multiplyScalar(1/e)}min(e){return this.x=Math.min(this.x,e.x),this.y=Math.min(this.y,e.y),this.z=Math.min(this.z,e.z),this}max(e){return this.x=Math.max(this.x,e.x),this.y=Math.max(this.y,e.y),this.z=Math.max(this.z,e.z),this}clamp(e,t){return this.x=Pe(this.x,e.x,t.x),this.y=Pe(this.y,e.y,t.y),this.z=Pe(this.z,e.z,t.z),this}clampScalar(e,t){return this.x=Pe(this.x,e,t),this.y=Pe(this.y,e,t),this.z=Pe(this.z,e,t),this}clampLength(e,t){let i=this.length();return this.divideScalar(i||1).multiplyScalar(Pe(i,e,t))}floor(){return this.x=Math.floor(this.x),this.y=Math.floor(this.y),this.z=Math.floor(this.z),this}ceil(){return this.x=Math.ceil(this.x),this.y=Math.ceil(this.y),this.z=Math.ceil(this.z),this}round(){return this.x=Math.round(this.x),this.y=Math.round(this.y),this.z=Math.round(this.z),this}roundToZero(){return this.x=Math.trunc(this.x),this.y=Math.trunc(this.y),this.z=Math.trunc(this.z),this}negate(){return this.x=-this.x,this.y=-this.y,this.z=-this.z,this}dot(e){return this.x*e.x+this.y*e.y+this.z*e.z}lengthSq(){return this.x*this.x+this.y*this.y+this.z*this.z}length(){return Math.sqrt(this.x*this.x+this.y*this.y+this.z*this.z)}manhattanLength(){return Math.abs(this.x)+Math.abs(this.y)+Math.abs(this.z)}normalize(){return this.divideScalar(this.length()||1)}setLength(e){return this.normalize().multiplyScalar(e)}lerp(e,t){return this.x+=(e.x-this.x)*t,this.y+=(e.y-this.y)*t,this.z+=(e.z-this.z)*t,this}lerpVectors(e,t,i){return this.x=e.x+(t.x-e.x)*i,this.y=e.y+(t.y-e.y)*i,this.z=e.z+(t.z-e.z)*i,this}cross(e){return this.crossVectors(this,e)}crossVectors(e,t){let i=e.x,r=e.y,o=e.z,s=t.x,a=t.y,c=t.z;return this.x=r*c-o*a,this.y=o*s-i*c,this.z=i*a-r*s,this}projectOnVector(e){let t=e.lengthSq();if(t===0)return this.set(0,0,0);let i=e.dot(this)/t;return this.copy(e).multiplyScalar(i)}projectOnPlane(e){return aa.copy(this).projectOnVector(e),this.sub(aa)}reflect(e){return this.sub(aa.copy(e).multiplyScalar(2*this.dot(e)))}angleTo(e){let t=Math.sqrt(this.lengthSq()*e.lengthSq());if(t===0)return Math.PI/2;let i=this.dot(e)/t;return Math.acos(Pe(i,-1,1))}distanceTo(e){return Math.sqrt(this.distanceToSquared(e))}distanceToSquared(e){let t=this.x-e.x,i=this.y-e.y,r=this.z-e.z;return t*t+i*i+r*r}manhattanDistanceTo(e){return Math.abs(this.x-e.x)+Math.abs(this.y-e.y)+Math.abs(this.z-e.z)}setFromSpherical(e){return this.setFromSphericalCoords(e.radius,e.phi,e.theta)}setFromSphericalCoords(e,t,i){let r=Math.sin(t)*e;return this.x=r*Math.sin(i),this.y=Math.cos(t)*e,this.z=r*Math.cos(i),this}setFromCylindrical(e){return this.setFromCylindricalCoords(e.radius,e.theta,e.y)}setFromCylindricalCoords(e,t,i){return this.x=e*Math.sin(t),this.y=i,this.z=e*Math.cos(t),this}setFromMatrixPosition(e){let t=e.elements;return this.x=t[12],this.y=t[13],this.z=t[14],this}setFromMatrixScale(e){let t=this.setFromMatrixColumn(e,0).length(),i=this.setFromMatrixColumn(e,1).length(),r=this.setFromMatrixColumn(e,2).length();return this.x=t,this.y=i,this.z=r,this}setFromMatrixColumn(e,t){return this.fromArray(e.elements,t*4)}setFromMatrix3Column(e,t){return this.fromArray(e.elements,t*3)}setFromEuler(e){return this.x=e._x,this.y=e._y,this.z=e._z,this}setFromColor(e){return this.x=e.r,this.y=e.g,this.z=e.b,this}equals(e){return e.x===this.x&&e.y===this.y&&e.z===this.z}fromArray(e,t=0){return this.x=e[t],this.y=e[t+1],this.z=e[t+2],this}toArray(e=[],t=0){return e[t]=this.x,e[t+1]=this.y,e[t+2]=this.z,e}fromBufferAttribute(e,t){return this.x=e.getX(t),this.y=e.getY(t),this.z=e.getZ(t),this}random(){return this.x=Math.random(),this.y=Math.random(),this.z=Math.random(),this}randomDirection(){let e=Math.random()*Math.PI*2,t=Math.random()*2-1,i=Math.sqrt(1-t*t);return this.x=i*Math.cos(e),this.y=t,this.z=i*Math.sin(e),this}*[Symbol.iterator](){yield this.x,yield this.y,yield this.z}},aa=new I,kl=new Zt;var Ee=class{static{this.prototype.isMatrix3=!0}constructor(e,t,i,r,o,s,a,c,l){this.elements=[1,0,0,0,1,0,0,0,1],e!==void 0&&this.set(e,t,i,r,o,s,a,c,l)}set(e,t,i,r,o,s,a,c,l){let f=this.elements;return f[0]=e,f[1]=r,f[2]=a,f[3]=t,f[4]=o,f[5]=c,f[6]=i,f[7]=s,f[8]=l,this}identity(){return this.set(1,0,0,0,1,0,0,0,1),this}copy(e){let t=this.elements,i=e.elements;return t[0]=i[0],t[1]=i[1],t[2]=i[2],t[3]=i[3],t[4]=i[4],t[5]=i[5],t[6]=i[6],t[7]=i[7],t[8]=i[8],this}extractBasis(e,t,i){return e.setFromMatrix3Column(this,0),t.setFromMatrix3Column(this,1),i.setFromMatrix3Column(this,2),this}setFromMatrix4(e){let t=e.elements;return this.set(t[0],t[4],t[8],t[1],t[5],t[9],t[2],t[6],t[10]),this}multiply(e){return this.multiplyMatrices(this,e)}premultiply(e){return this.multiplyMatrices(e,this)}multiplyMatrices(e,t){let i=e.elements,r=t.elements,o=this.elements,s=i[0],a=i[3],c=i[6],l=i[1],f=i[4],d=i[7],h=i[2],m=i[5],x=i[8],v=r[0],p=r[3],u=r[6],y=r[1],A=r[4],M=r[7],C=r[2],b=r[5],g=r[8];return o[0]=s*v+a*y+c*C,o[3]=s*p+a*A+c*b,o[6]=s*u+a*M+c*g,o[1]=l*v+f*y+d*C,o[4]=l*p+f*A+d*b,o[7]=l*u+f*M+d*g,o[2]=h*v+m*y+x*C,o[5]=h*p+m*A+x*b,o[8]=h*u+m*M+x*g,this}multiplyScalar(e){let t=this.elements;return t[0]*=e,t[3]*=e,t[6]*=e,t[1]*=e,t[4]*=e,t[7]*=e,t[2]*=e,t[5]*=e,t[8]*=e,this}determinant(){let e=this.elements,t=e[0],i=e[1],r=e[2],o=e[3],s=e[4],a=e[5],c=e[6],l=e[7],f=e[8];return t*s*f-t*a*l-i*o*f+i*a*c+r*o*l-r*s*c}invert(){let e=this.elements,t=e[0],i=e[1],r=e[2],o=e[3],s=e[4],a=e[5],c=e[6],l=e[7],f=e[8],d=f*s-a*l,h=a*c-f*o,m=l*o-s*c,x=t*d+i*h+r*m;if(x===0)return this.set(0,0,0,0,0,0,0,0,0);let v=1/x;return e[0]=d*v,e[1]=(r*l-f*i)*v,e[2]=(a*i-r*s)*v,e[3]=h*v,e[4]=(f*t-r*c)*v,e[5]=(r*o-a*t)*v,e[6]=m*v,e[7]=(i*c-l*t)*v,e[8]=(s*t-i*o)*v,this}transpose(){let e,t=this.elements;return e=t[1],t[1]=t[3],t[3]=e,e=t[2],t[2]=t[6],t[6]=e,e=t[5],t[5]=t[7],t[7]=e,this}getNormalMatrix(e){return this.setFromMatrix4(e).invert().transpose()}transposeIntoArray(e){let t=this.elements;return e[0]=t[0],e[1]=t[3],e[2]=t[6],e[3]=t[1],e[4]=t[4],e[5]=t[7],e[6]=t[2],e[7]=t[5],e[8]=t[8],this}setUvTransform(e,t,i,r,o,s,a){let c=Math.cos(o),l=Math.sin(o);return this.set(i*c,i*l,-i*(c*s+l*a)+s+e,-r*l,r*c,-r*(-l*s+c*a)+a+t,0,0,1),this}scale(e,t){return fn("Matrix3: .scale() is deprecated. Use .makeScale() instead."),this.premultiply(la.makeScale(e,t)),this}rotate(e){return fn("Matrix3: .rotate() is deprecated. Use .makeRotation() instead."),this.premultiply(la.makeRotation(-e)),this}translate(e,t){return fn("Matrix3: .translate() is deprecated. Use .makeTranslation() instead."),this.premultiply(la.makeTranslation(e,t)),this}makeTranslation(e,t){return e.isVector2?this.set(1,0,e.x,0,1,e.y,0,0,1):this.set(1,0,e,0,1,t,0,0,1),this}makeRotation(e){let t=Math.cos(e),i=Math.sin(e);return this.set(t,-i,0,i,t,0,0,0,1),this}makeScale(e,t){return this.set(e,0,0,0,t,0,0,0,1),this}equals(e){let t=this.elements,i=e.elements;for(let r=0;r<9;r++)if(t[r]!==i[r])return!1;return!0}fromArray(e,t=0){for(let i=0;i<9;i++)this.elements[i]=e[i+t];return this}toArray(e=[],t=0){let i=this.elements;return e[t]=i[0],e[t+1]=i[1],e[t+2]=i[2],e[t+3]=i[3],e[t+4]=i[4],e[t+5]=i[5],e[t+6]=i[6],e[t+7]=i[7],e[t+8]=i[8],e}clone(){return new this.constructor().fromArray(this.elements)}},la=new Ee;var Wl=new Ee().set(.4123908,.3575843,.1804808,.212639,.7151687,.0721923,.0193308,.1191948,.9505322),Xl=new Ee().set(3.2409699,-1.5373832,-.4986108,-.9692436,1.8759675,.0415551,.0556301,-.203977,1.0569715);function Nd(){let n={enabled:!0,workingColorSpace:jr,spaces:{},convert:function(r,o,s){return this.enabled===!1||o===s||!o||!s||(this.spaces[o].transfer===ze&&(r.r=_i(r.r),r.g=_i(r.g),r.b=_i(r.b)),this.spaces[o].primaries!==this.spaces[s].primaries&&(r.applyMatrix3(this.spaces[o].toXYZ),r.applyMatrix3(this.spaces[s].fromXYZ)),this.spaces[s].transfer===ze&&(r.r=un(r.r),r.g=un(r.g),r.b=un(r.b))),r},workingToColorSpace:function(r,o){return this.convert(r,this.workingColorSpace,o)},colorSpaceToWorking:function(r,o){return this.convert(r,o,this.workingColorSpace)},getPrimaries:function(r){return this.spaces[r].primaries},getTransfer:function(r){return r===fi?cn:this.spaces[r].transfer},getToneMappingMode:function(r){return this.spaces[r].outputColorSpaceConfig.toneMappingMode||"standard"},getLuminanceCoefficients:function(r,o=this.workingColorSpace){return r.fromArray(this.spaces[o].luminanceCoefficients)},define:function(r){Object.assign(this.spaces,r)},_getMatrix:function(r,o,s){return r.copy(this.spaces[s].fromXYZ).multiply(this.spaces[o].toXYZ)},_getDrawingBufferColorSpace:function(r){return this.spaces[r].outputColorSpaceConfig.drawingBufferColorSpace},_getUnpackColorSpace:function(r=this.workingColorSpace){return this.spaces[r].workingColorSpaceConfig.unpackColorSpace}},e=[.64,.33,.3,.6,.15,.06],t=[.2126,.7152,.0722],i=[.3127,.329];return n.define({[jr]:{primaries:e,whitePoint:i,transfer:cn,toXYZ:Wl,fromXYZ:Xl,luminanceCoefficients:t,workingColorSpaceConfig:{unpackColorSpace:Ht},outputColorSpaceConfig:{drawingBufferColorSpace:Ht}},[Ht]:{primaries:e,whitePoint:i,transfer:ze,toXYZ:Wl,fromXYZ:Xl,luminanceCoefficients:t,outputColorSpaceConfig:{drawingBufferColorSpace:Ht}}}),n}var Re=Nd();function _i(n){return n<.04045?n*.0773993808:Math.pow(n*.9478672986+.0521327014,2.4)}function un(n){return n<.0031308?n*12.92:1.055*Math.pow(n,.41666)-.055}var Un,Ho=class{static getDataURL(e,t="image/png"){if(/^data:/i.test(e.src)||typeof HTMLCanvasElement>"u")return e.src;let i;if(e instanceof HTMLCanvasElement)i=e;else{Un===void 0&&(Un=Ln("canvas")),Un.width=e.width,Un.height=e.height;let r=Un.getContext("2d");e instanceof ImageData?r.putImageData(e,0,0):r.drawImage(e,0,0,e.width,e.height),i=Un}return i.toDataURL(t)}static sRGBToLinear(e){if(typeof HTMLImageElement<"u"&&e instanceof HTMLImageElement||typeof HTMLCanvasElement<"u"&&e instanceof HTMLCanvasElement||typeof ImageBitmap<"u"&&e instanceof ImageBitmap){let t=Ln("canvas");t.width=e.width,t.height=e.height;let i=t.getContext("2d");i.drawImage(e,0,0,e.width,e.height);let r=i.getImageData(0,0,e.width,e.height),o=r.data;for(let s=0;s<o.length;s++)o[s]=_i(o[s]/255)*255;return i.putImageData(r,0,0),t}else if(e.data){let t=e.data.slice(0);for(let i=0;i<t.length;i++)t instanceof Uint8Array||t instanceof Uint8ClampedArray?t[i]=Math.floor(_i(t[i]/255)*255):t[i]=_i(t[i]);return{data:t,width:e.width,height:e.height}}else return pe("ImageUtils.sRGBToLinear(): Unsupported image type. No color space conversion applied."),e}};var Fd=0,ki=class{constructor(e=null){this.isTextureSource=!0,Object.defineProperty(this,"id",{value:Fd++}),this.uuid=gi(),this.data=e,this.dataReady=!0,this.version=0}getSize(e){let t=this.data;return typeof HTMLVideoElement<"u"&&t instanceof HTMLVideoElement?e.set(t.videoWidth,t.videoHeight,0):typeof VideoFrame<"u"&&t instanceof VideoFrame?e.set(t.displayWidth,t.displayHeight,0):t!==null?e.set(t.width||0,t.height||0,t.depth||0):e.set(0,0,0),e}set needsUpdate(e){e===!0&&this.version++}toJSON(e){let t=e===void 0||typeof e=="string";if(!t&&e.images[this.uuid]!==void 0)return e.images[this.uuid];let i={uuid:this.uuid,url:""},r=this.data;if(r!==null){let o;if(Array.isArray(r)){o=[];for(let s=0,a=r.length;s<a;s++)r[s].isDataTexture?o.push(ca(r[s].image)):o.push(ca(r[s]))}else o=ca(r);i.url=o}return t||(e.images[this.uuid]=i),i}};function ca(n){return typeof HTMLImageElement<"u"&&n instanceof HTMLImageElement||typeof HTMLCanvasElement<"u"&&n instanceof HTMLCanvasElement||typeof ImageBitmap<"u"&&n instanceof ImageBitmap?Ho.getDataURL(n):n.data?{data:Array.from(n.data),width:n.width,height:n.height,type:n.data.constructor.name}:(pe("Texture: Unable to serialize Texture."),{})}var Od=0,fa=new I,lt=class n extends yt{constructor(e=n.DEFAULT_IMAGE,t=n.DEFAULT_MAPPING,i=qt,r=qt,o=ft,s=pi,a=Yt,c=Tt,l=n.DEFAULT_ANISOTROPY,f=fi){super(),this.isTexture=!0,Object.defineProperty(this,"id",{value:Od++}),this.uuid=gi(),this.name="",this.source=new ki(e),this.mipmaps=[],this.mapping=t,this.channel=0,this.wrapS=i,this.wrapT=r,this.magFilter=o,this.minFilter=s,this.anisotropy=l,this.format=a,this.internalFormat=null,this.type=c,this.offset=new ye(0,0),this.repeat=new ye(1,1),this.center=new ye(0,0),this.rotation=0,this.matrixAutoUpdate=!0,this.matrix=new Ee,this.generateMipmaps=!0,this.mipmapsAutoUpdate=!0,this.premultiplyAlpha=!1,this.flipY=!0,this.unpackAlignment=4,this.colorSpace=f,this.userData={},this.updateRanges=[],this.version=0,this.onUpdate=null,this.renderTarget=null,this.isRenderTargetTexture=!1,this.isArrayTexture=!!(e&&e.depth&&e.depth>1),this.pmremVersion=0,this.isPMREMTexture=!1,this.normalized=!1}get width(){return this.source.getSize(fa).x}get height(){return this.source.getSize(fa).y}get depth(){return this.source.getSize(fa).z}get image(){return this.source.data}set image(e){this.source.data=e}updateMatrix(){this.matrix.setUvTransform(this.offset.x,this.offset.y,this.repeat.x,this.repeat.y,this.rotation,this.center.x,this.center.y)}addUpdateRange(e,t){this.updateRanges.push({start:e,count:t})}clearUpdateRanges(){this.updateRanges.length=0}clone(){return new this.constructor().copy(this)}copy(e){return this.name=e.name,this.source=e.source,this.mipmaps=e.mipmaps.slice(0),this.mapping=e.mapping,this.channel=e.channel,this.wrapS=e.wrapS,this.wrapT=e.wrapT,this.magFilter=e.magFilter,this.minFilter=e.minFilter,this.anisotropy=e.anisotropy,this.format=e.format,this.internalFormat=e.internalFormat,this.type=e.type,this.normalized=e.normalized,this.offset.copy(e.offset),this.repeat.copy(e.repeat),this.center.copy(e.center),this.rotation=e.rotation,this.matrixAutoUpdate=e.matrixAutoUpdate,this.matrix.copy(e.matrix),this.generateMipmaps=e.generateMipmaps,this.mipmapsAutoUpdate=e.mipmapsAutoUpdate,this.premultiplyAlpha=e.premultiplyAlpha,this.flipY=e.flipY,this.unpackAlignment=e.unpackAlignment,this.colorSpace=e.colorSpace,this.renderTarget=e.renderTarget,this.isRenderTargetTexture=e.isRenderTargetTexture,this.isPMREMTexture=e.isPMREMTexture,this.isArrayTexture=e.isArrayTexture,this.userData=JSON.parse(JSON.stringify(e.userData)),this.needsUpdate=!0,this}setValues(e){for(let t in e){let i=e[t];if(i===void 0){pe(`Texture.setValues(): parameter '${t}' has value of undefined.`);continue}let r=this[t];if(r===void 0){pe(`Texture.setValues(): property '${t}' does not exist.`);continue}r&&i&&r.isVector2&&i.isVector2||r&&i&&r.isVector3&&i.isVector3||r&&i&&r.isMatrix3&&i.isMatrix3?r.copy(i):this[t]=i}}toJSON(e){let t=e===void 0||typeof e=="string";if(!t&&e.textures[this.uuid]!==void 0)return e.textures[this.uuid];let i={metadata:{version:4.7,type:"Texture",generator:"Texture.toJSON"},uuid:this.uuid,name:this.name,image:this.source.toJSON(e).uuid,mapping:this.mapping,channel:this.channel,repeat:[this.repeat.x,this.repeat.y],offset:[this.offset.x,this.offset.y],center:[this.center.x,this.center.y],rotation:this.rotation,wrap:[this.wrapS,this.wrapT],format:this.format,internalFormat:this.internalFormat,type:this.type,normalized:this.normalized,colorSpace:this.colorSpace,minFilter:this.minFilter,magFilter:this.magFilter,anisotropy:this.anisotropy,flipY:this.flipY,generateMipmaps:this.generateMipmaps,mipmapsAutoUpdate:this.mipmapsAutoUpdate,premultiplyAlpha:this.premultiplyAlpha,unpackAlignment:this.unpackAlignment};return Object.keys(this.userData).length>0&&(i.userData=this.userData),t||(e.textures[this.uuid]=i),i}dispose(){this.dispatchEvent({type:"dispose"})}transformUv(e){if(this.mapping!==ia)return e;if(e.applyMatrix3(this.matrix),e.x<0||e.x>1)switch(this.wrapS){case Mr:e.x=e.x-Math.floor(e.x);break;case qt:e.x=e.x<0?0:1;break;case vr:Math.abs(Math.floor(e.x)%2)===1?e.x=Math.ceil(e.x)-e.x:e.x=e.x-Math.floor(e.x);break}if(e.y<0||e.y>1)switch(this.wrapT){case Mr:e.y=e.y-Math.floor(e.y);break;case qt:e.y=e.y<0?0:1;break;case vr:Math.abs(Math.floor(e.y)%2)===1?e.y=Math.ceil(e.y)-e.y:e.y=e.y-Math.floor(e.y);break}return this.flipY&&(e.y=1-e.y),e}set needsUpdate(e){e===!0&&(this.version++,this.source.needsUpdate=!0)}set needsPMREMUpdate(e){e===!0&&this.pmremVersion++}};lt.DEFAULT_IMAGE=null;lt.DEFAULT_MAPPING=ia;lt.DEFAULT_ANISOTROPY=1;var We=class{static{this.prototype.isVector4=!0}constructor(e=0,t=0,i=0,r=1){this.x=e,this.y=t,this.z=i,this.w=r}get width(){return this.z}set width(e){this.z=e}get height(){return this.w}set height(e){this.w=e}set(e,t,i,r){return this.x=e,this.y=t,this.z=i,this.w=r,this}setScalar(e){return this.x=e,this.y=e,this.z=e,this.w=e,this}setX(e){return this.x=e,this}setY(e){return this.y=e,this}setZ(e){return this.z=e,this}setW(e){return this.w=e,this}setComponent(e,t){switch(e){case 0:this.x=t;break;case 1:this.y=t;break;case 2:this.z=t;break;case 3:this.w=t;break;default:throw new Error("THREE.Vector4: index is out of range: "+e)}return this}getComponent(e){switch(e){case 0:return this.x;case 1:return this.y;case 2:return this.z;case 3:return this.w;default:throw new Error("THREE.Vector4: index is out of range: "+e)}}clone(){return new this.constructor(this.x,this.y,this.z,this.w)}copy(e){return this.x=e.x,this.y=e.y,this.z=e.z,this.w=e.w!==void 0?e.w:1,this}add(e){return this.x+=e.x,this.y+=e.y,this.z+=e.z,this.w+=e.w,this}addScalar(e){return this.x+=e,this.y+=e,this.z+=e,this.w+=e,this}addVectors(e,t){return this.x=e.x+t.x,this.y=e.y+t.y,this.z=e.z+t.z,this.w=e.w+t.w,this}addScaledVector(e,t){return this.x+=e.x*t,this.y+=e.y*t,this.z+=e.z*t,this.w+=e.w*t,this}sub(e){return this.x-=e.x,this.y-=e.y,this.z-=e.z,this.w-=e.w,this}subScalar(e){return this.x-=e,this.y-=e,this.z-=e,this.w-=e,this}subVectors(e,t){return this.x=e.x-t.x,this.y=e.y-t.y,this.z=e.z-t.z,this.w=e.w-t.w,this}multiply(e){return this.x*=e.x,this.y*=e.y,this.z*=e.z,this.w*=e.w,this}multiplyScalar(e){return this.x*=e,this.y*=e,this.z*=e,this.w*=e,this}applyMatrix4(e){let t=this.x,i=this.y,r=this.z,o=this.w,s=e.elements;return this.x=s[0]*t+s[4]*i+s[8]*r+s[12]*o,this.y=s[1]*t+s[5]*i+s[9]*r+s[13]*o,this.z=s[2]*t+s[6]*i+s[10]*r+s[14]*o,this.w=s[3]*t+s[7]*i+s[11]*r+s[15]*o,this}divide(e){return this.x/=e.x,this.y/=e.y,this.z/=e.z,this.w/=e.w,this}divideScalar(e){return this.multiplyScalar(1/e)}setAxisAngleFromQuaternion(e){this.w=2*Math.acos(e.w);let t=Math.sqrt(1-e.w*e.w);return t<1e-4?(this.x=1,this.y=0,this.z=0):(this.x=e.x/t,this.y=e.y/t,this.z=e.z/t),this}setAxisAngleFromRotationMatrix(e){let t,i,r,o,c=e.elements,l=c[0],f=c[4],d=c[8],h=c[1],m=c[5],x=c[9],v=c[2],p=c[6],u=c[10];if(Math.abs(f-h)<.01&&Math.abs(d-v)<.01&&Math.abs(x-p)<.01){if(Math.abs(f+h)<.1&&Math.abs(d+v)<.1&&Math.abs(x+p)<.1&&Math.abs(l+m+u-3)<.1)return this.set(1,0,0,0),this;t=Math.PI;let A=(l+1)/2,M=(m+1)/2,C=(u+1)/2,b=(f+h)/4,g=(d+v)/4,T=(x+p)/4;return A>M&&A>C?A<.01?(i=0,r=.707106781,o=.707106781):(i=Math.sqrt(A),r=b/i,o=g/i):M>C?M<.01?(i=.707106781,r=0,o=.707106781):(r=Math.sqrt(M),i=b/r,o=T/r):C<.01?(i=.707106781,r=.707106781,o=0):(o=Math.sqrt(C),i=g/o,r=T/o),this.set(i,r,o,t),this}let y=Math.sqrt((p-x)*(p-x)+(d-v)*(d-v)+(h-f)*(h-f));return Math.abs(y)<.001&&(y=1),this.x=(p-x)/y,this.y=(d-v)/y,this.z=(h-f)/y,this.w=Math.acos((l+m+u-1)/2),this}setFromMatrixPosition(e){let t=e.elements;return this.x=t[12],this.y=t[13],this.z=t[14],this.w=t[15],this}min(e){return this.x=Math.min(this.x,e.x),this.y=Math.min(this.y,e.y),this.z=Math.min(this.z,e.z),this.w=Math.min(this.w,e.w),this}max(e){return this.x=Math.max(this.x,e.x),this.y=Math.max(this.y,e.y),this.z=Math.max(this.z,e.z),this.w=Math.max(this.w,e.w),this}clamp(e,t){return this.x=Pe(this.x,e.x,t.x),this.y=Pe(this.y,e.y,t.y),this.z=Pe(this.z,e.z,t.z),this.w=Pe(this.w,e.w,t.w),this}clampScalar(e,t){return this.x=Pe(this.x,e,t),this.y=Pe(this.y,e,t),this.z=Pe(this.z,e,t),this.w=Pe(this.w,e,t),this}clampLength(e,t){let i=this.length();return this.divideScalar(i||1).multiplyScalar(Pe(i,e,t))}floor(){return this.x=Math.floor(this.x),this.y=Math.floor(this.y),this.z=Math.floor(this.z),this.w=Math.floor(this.w),this}ceil(){return this.x=Math.ceil(this.x),this.y=Math.ceil(this.y),this.z=Math.ceil(this.z),this.w=Math.ceil(this.w),this}round(){return this.x=Math.round(this.x),this.y=Math.round(this.y),this.z=Math.round(this.z),this.w=Math.round(this.w),this}roundToZero(){return this.x=Math.trunc(this.x),this.y=Math.trunc(this.y),this.z=Math.trunc(this.z),this.w=Math.trunc(this.w),this}negate(){return this.x=-this.x,this.y=-this.y,this.z=-this.z,this.w=-this.w,this}dot(e){return this.x*e.x+this.y*e.y+this.z*e.z+this.w*e.w}lengthSq(){return this.x*this.x+this.y*this.y+this.z*this.z+this.w*this.w}length(){return Math.sqrt(this.x*this.x+this.y*this.y+this.z*this.z+this.w*this.w)}manhattanLength(){return Math.abs(this.x)+Math.abs(this.y)+Math.abs(this.z)+Math.abs(this.w)}normalize(){return this.divideScalar(this.length()||1)}setLength(e){return this.normalize().multiplyScalar(e)}lerp(e,t){return this.x+=(e.x-this.x)*t,this.y+=(e.y-this.y)*t,this.z+=(e.z-this.z)*t,this.w+=(e.w-this.w)*t,this}lerpVectors(e,t,i){return this.x=e.x+(t.x-e.x)*i,this.y=e.y+(t.y-e.y)*i,this.z=e.z+(t.z-e.z)*i,this.w=e.w+(t.w-e.w)*i,this}equals(e){return e.x===this.x&&e.y===this.y&&e.z===this.z&&e.w===this.w}fromArray(e,t=0){return this.x=e[t],this.y=e[t+1],this.z=e[t+2],this.w=e[t+3],this}toArray(e=[],t=0){return e[t]=this.x,e[t+1]=this.y,e[t+2]=this.z,e[t+3]=this.w,e}fromBufferAttribute(e,t){return this.x=e.getX(t),this.y=e.getY(t),this.z=e.getZ(t),this.w=e.getW(t),this}random(){return this.x=Math.random(),this.y=Math.random(),this.z=Math.random(),this.w=Math.random(),this}*[Symbol.iterator](){yield this.x,yield this.y,yield this.z,yield this.w}};var Vo=class extends yt{constructor(e=1,t=1,i={}){super(),i=Object.assign({generateMipmaps:!1,internalFormat:null,minFilter:ft,depthBuffer:!0,stencilBuffer:!1,resolveColorBuffer:!0,resolveDepthBuffer:!0,resolveStencilBuffer:!0,storeMultisampledColorBuffer:!0,storeMultisampledDepthBuffer:!0,storeMultisampledStencilBuffer:!0,depthTexture:null,samples:0,count:1,depth:1,multiview:!1,useArrayDepthTexture:!1},i),this.isRenderTarget=!0,this.width=e,this.height=t,this.depth=i.depth,this.scissor=new We(0,0,e,t),this.scissorTest=!1,this.viewport=new We(0,0,e,t),this.textures=[];let r=i.count;for(let o=0;o<r;o++)this.textures[o]=new lt({width:e,height:t,depth:i.depth}),this.textures[o].isRenderTargetTexture=!0,this.textures[o].renderTarget=this;this._setTextureOptions(i),this.depthBuffer=i.depthBuffer,this.stencilBuffer=i.stencilBuffer,this.resolveColorBuffer=i.resolveColorBuffer,this.resolveDepthBuffer=i.resolveDepthBuffer,this.resolveStencilBuffer=i.resolveStencilBuffer,this.storeMultisampledColorBuffer=i.storeMultisampledColorBuffer,this.storeMultisampledDepthBuffer=i.storeMultisampledDepthBuffer,this.storeMultisampledStencilBuffer=i.storeMultisampledStencilBuffer,this._depthTexture=null,this.depthTexture=i.depthTexture,this.samples=i.samples,this.multiview=i.multiview,this.useArrayDepthTexture=i.useArrayDepthTexture}_setTextureOptions(e={}){let t={minFilter:ft,generateMipmaps:!1,flipY:!1,internalFormat:null};e.mapping!==void 0&&(t.mapping=e.mapping),e.wrapS!==void 0&&(t.wrapS=e.wrapS),e.wrapT!==void 0&&(t.wrapT=e.wrapT),e.wrapR!==void 0&&(t.wrapR=e.wrapR),e.magFilter!==void 0&&(t.magFilter=e.magFilter),e.minFilter!==void 0&&(t.minFilter=e.minFilter),e.format!==void 0&&(t.format=e.format),e.type!==void 0&&(t.type=e.type),e.anisotropy!==void 0&&(t.anisotropy=e.anisotropy),e.colorSpace!==void 0&&(t.colorSpace=e.colorSpace),e.flipY!==void 0&&(t.flipY=e.flipY),e.generateMipmaps!==void 0&&(t.generateMipmaps=e.generateMipmaps),e.mipmapsAutoUpdate!==void 0&&(t.mipmapsAutoUpdate=e.mipmapsAutoUpdate),e.internalFormat!==void 0&&(t.internalFormat=e.internalFormat);for(let i=0;i<this.textures.length;i++)this.textures[i].setValues(t)}get texture(){return this.textures[0]}set texture(e){this.textures[0]=e}set depthTexture(e){this._depthTexture!==null&&this._depthTexture.renderTarget===this&&(this._depthTexture.renderTarget=null),e!==null&&e.renderTarget===null&&(e.renderTarget=this),this._depthTexture=e}get depthTexture(){return this._depthTexture}setSize(e,t,i=1){if(this.width!==e||this.height!==t||this.depth!==i){this.width=e,this.height=t,this.depth=i;for(let r=0,o=this.textures.length;r<o;r++)this.textures[r].image.width=e,this.textures[r].image.height=t,this.textures[r].image.depth=i,this.textures[r].isData3DTexture!==!0&&(this.textures[r].isArrayTexture=this.textures[r].image.depth>1);this.dispose()}this.viewport.set(0,0,e,t),this.scissor.set(0,0,e,t)}clone(){return new this.constructor().copy(this)}copy(e){this.width=e.width,this.height=e.height,this.depth=e.depth,this.scissor.copy(e.scissor),this.scissorTest=e.scissorTest,this.viewport.copy(e.viewport),this.textures.length=0;for(let t=0,i=e.textures.length;t<i;t++){this.textures[t]=e.textures[t].clone(),this.textures[t].isRenderTargetTexture=!0,this.textures[t].renderTarget=this;let r=Object.assign({},e.textures[t].image);this.textures[t].source=new ki(r)}if(this.depthBuffer=e.depthBuffer,this.stencilBuffer=e.stencilBuffer,this.resolveColorBuffer=e.resolveColorBuffer,this.resolveDepthBuffer=e.resolveDepthBuffer,this.resolveStencilBuffer=e.resolveStencilBuffer,this.storeMultisampledColorBuffer=e.storeMultisampledColorBuffer,this.storeMultisampledDepthBuffer=e.storeMultisampledDepthBuffer,this.storeMultisampledStencilBuffer=e.storeMultisampledStencilBuffer,e.depthTexture!==null)if(e.depthTexture.renderTarget===e){let t=e.depthTexture.clone();t.renderTarget=null,this.depthTexture=t}else this.depthTexture=e.depthTexture;else this.depthTexture=null;return this.samples=e.samples,this.multiview=e.multiview,this.useArrayDepthTexture=e.useArrayDepthTexture,this}dispose(){this.dispatchEvent({type:"dispose"})}};var Nt=class extends Vo{constructor(e=1,t=1,i={}){super(e,t,i),this.isWebGLRenderTarget=!0}};var Nn=class extends lt{constructor(e=null,t=1,i=1,r=1){super(null),this.isDataArrayTexture=!0,this.image={data:e,width:t,height:i,depth:r},this.magFilter=et,this.minFilter=et,this.wrapR=qt,this.generateMipmaps=!1,this.flipY=!1,this.unpackAlignment=1,this.layerUpdates=new Set}copy(e){return super.copy(e),this.wrapR=e.wrapR,this}addLayerUpdate(e){this.layerUpdates.add(e)}clearLayerUpdates(){this.layerUpdates.clear()}};var ko=class extends lt{constructor(e=null,t=1,i=1,r=1){super(null),this.isData3DTexture=!0,this.image={data:e,width:t,height:i,depth:r},this.magFilter=et,this.minFilter=et,this.wrapR=qt,this.generateMipmaps=!1,this.flipY=!1,this.unpackAlignment=1}copy(e){return super.copy(e),this.wrapR=e.wrapR,this}};var we=class n{static{this.prototype.isMatrix4=!0}constructor(e,t,i,r,o,s,a,c,l,f,d,h,m,x,v,p){this.elements=[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],e!==void 0&&this.set(e,t,i,r,o,s,a,c,l,f,d,h,m,x,v,p)}set(e,t,i,r,o,s,a,c,l,f,d,h,m,x,v,p){let u=this.elements;return u[0]=e,u[4]=t,u[8]=i,u[12]=r,u[1]=o,u[5]=s,u[9]=a,u[13]=c,u[2]=l,u[6]=f,u[10]=d,u[14]=h,u[3]=m,u[7]=x,u[11]=v,u[15]=p,this}identity(){return this.set(1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1),this}clone(){return new n().fromArray(this.elements)}copy(e){let t=this.elements,i=e.elements;return t[0]=i[0],t[1]=i[1],t[2]=i[2],t[3]=i[3],t[4]=i[4],t[5]=i[5],t[6]=i[6],t[7]=i[7],t[8]=i[8],t[9]=i[9],t[10]=i[10],t[11]=i[11],t[12]=i[12],t[13]=i[13],t[14]=i[14],t[15]=i[15],this}copyPosition(e){let t=this.elements,i=e.elements;return t[12]=i[12],t[13]=i[13],t[14]=i[14],this}setFromMatrix3(e){let t=e.elements;return this.set(t[0],t[3],t[6],0,t[1],t[4],t[7],0,t[2],t[5],t[8],0,0,0,0,1),this}extractBasis(e,t,i){return this.determinantAffine()===0?(e.set(1,0,0),t.set(0,1,0),i.set(0,0,1),this):(e.setFromMatrixColumn(this,0),t.setFromMatrixColumn(this,1),i.setFromMatrixColumn(this,2),this)}makeBasis(e,t,i){return this.set(e.x,t.x,i.x,0,e.y,t.y,i.y,0,e.z,t.z,i.z,0,0,0,0,1),this}extractRotation(e){if(e.determinantAffine()===0)return this.identity();let t=this.elements,i=e.elements,r=1/Fn.setFromMatrixColumn(e,0).length(),o=1/Fn.setFromMatrixColumn(e,1).length(),s=1/Fn.setFromMatrixColumn(e,2).length();return t[0]=i[0]*r,t[1]=i[1]*r,t[2]=i[2]*r,t[3]=0,t[4]=i[4]*o,t[5]=i[5]*o,t[6]=i[6]*o,t[7]=0,t[8]=i[8]*s,t[9]=i[9]*s,t[10]=i[10]*s,t[11]=0,t[12]=0,t[13]=0,t[14]=0,t[15]=1,this}makeRotationFromEuler(e){let t=this.elements,i=e.x,r=e.y,o=e.z,s=Math.cos(i),a=Math.sin(i),c=Math.cos(r),l=Math.sin(r),f=Math.cos(o),d=Math.sin(o);if(e.order==="XYZ"){let h=s*f,m=s*d,x=a*f,v=a*d;t[0]=c*f,t[4]=-c*d,t[8]=l,t[1]=m+x*l,t[5]=h-v*l,t[9]=-a*c,t[2]=v-h*l,t[6]=x+m*l,t[10]=s*c}else if(e.order==="YXZ"){let h=c*f,m=c*d,x=l*f,v=l*d;t[0]=h+v*a,t[4]=x*a-m,t[8]=s*l,t[1]=s*d,t[5]=s*f,t[9]=-a,t[2]=m*a-x,t[6]=v+h*a,t[10]=s*c}else if(e.order==="ZXY"){let h=c*f,m=c*d,x=l*f,v=l*d;t[0]=h-v*a,t[4]=-s*d,t[8]=x+m*a,t[1]=m+x*a,t[5]=s*f,t[9]=v-h*a,t[2]=-s*l,t[6]=a,t[10]=s*c}else if(e.order==="ZYX"){let h=s*f,m=s*d,x=a*f,v=a*d;t[0]=c*f,t[4]=x*l-m,t[8]=h*l+v,t[1]=c*d,t[5]=v*l+h,t[9]=m*l-x,t[2]=-l,t[6]=a*c,t[10]=s*c}else if(e.order==="YZX"){let h=s*c,m=s*l,x=a*c,v=a*l;t[0]=c*f,t[4]=v-h*d,t[8]=x*d+m,t[1]=d,t[5]=s*f,t[9]=-a*f,t[2]=-l*f,t[6]=m*d+x,t[10]=h-v*d}else if(e.order==="XZY"){let h=s*c,m=s*l,x=a*c,v=a*l;t[0]=c*f,t[4]=-d,t[8]=l*f,t[1]=h*d+v,t[5]=s*f,t[9]=m*d-x,t[2]=x*d-m,t[6]=a*f,t[10]=v*d+h}return t[3]=0,t[7]=0,t[11]=0,t[12]=0,t[13]=0,t[14]=0,t[15]=1,this}makeRotationFromQuaternion(e){return this.compose(Bd,e,Gd)}lookAt(e,t,i){let r=this.elements;return ei.subVectors(e,t),ei.lengthSq()===0&&(ei.z=1),ei.normalize(),Wi.crossVectors(i,ei),Wi.lengthSq()===0&&(Math.abs(i.z)===1?ei.x+=1e-4:ei.z+=1e-4,ei.normalize(),Wi.crossVectors(i,ei)),Wi.normalize(),Wo.crossVectors(ei,Wi),r[0]=Wi.x,r[4]=Wo.x,r[8]=ei.x,r[1]=Wi.y,r[5]=Wo.y,r[9]=ei.y,r[2]=Wi.z,r[6]=Wo.z,r[10]=ei.z,this}multiply(e){return this.multiplyMatrices(this,e)}premultiply(e){return this.multiplyMatrices(e,this)}multiplyMatrices(e,t){let i=e.elements,r=t.elements,o=this.elements,s=i[0],a=i[4],c=i[8],l=i[12],f=i[1],d=i[5],h=i[9],m=i[13],x=i[2],v=i[6],p=i[10],u=i[14],y=i[3],A=i[7],M=i[11],C=i[15],b=r[0],g=r[4],T=r[8],B=r[12],D=r[1],U=r[5],z=r[9],$=r[13],P=r[2],W=r[6],K=r[10],H=r[14],te=r[3],k=r[7],J=r[11],Q=r[15];return o[0]=s*b+a*D+c*P+l*te,o[4]=s*g+a*U+c*W+l*k,o[8]=s*T+a*z+c*K+l*J,o[12]=s*B+a*$+c*H+l*Q,o[1]=f*b+d*D+h*P+m*te,o[5]=f*g+d*U+h*W+m*k,o[9]=f*T+d*z+h*K+m*J,o[13]=f*B+d*$+h*H+m*Q,o[2]=x*b+v*D+p*P+u*te,o[6]=x*g+v*U+p*W+u*k,o[10]=x*T+v*z+p*K+u*J,o[14]=x*B+v*$+p*H+u*Q,o[3]=y*b+A*D+M*P+C*te,o[7]=y*g+A*U+M*W+C*k,o[11]=y*T+A*z+M*K+C*J,o[15]=y*B+A*$+M*H+C*Q,this}multiplyScalar(e){let t=this.elements;return t[0]*=e,t[4]*=e,t[8]*=e,t[12]*=e,t[1]*=e,t[5]*=e,t[9]*=e,t[13]*=e,t[2]*=e,t[6]*=e,t[10]*=e,t[14]*=e,t[3]*=e,t[7]*=e,t[11]*=e,t[15]*=e,this}determinant(){let e=this.elements,t=e[0],i=e[4],r=e[8],o=e[12],s=e[1],a=e[5],c=e[9],l=e[13],f=e[2],d=e[6],h=e[10],m=e[14],x=e[3],v=e[7],p=e[11],u=e[15],y=c*m-l*h,A=a*m-l*d,M=a*h-c*d,C=s*m-l*f,b=s*h-c*f,g=s*d-a*f;return t*(v*y-p*A+u*M)-i*(x*y-p*C+u*b)+r*(x*A-v*C+u*g)-o*(x*M-v*b+p*g)}determinantAffine(){let e=this.elements,t=e[0],i=e[4],r=e[8],o=e[1],s=e[5],a=e[9],c=e[2],l=e[6],f=e[10];return t*(s*f-a*l)-i*(o*f-a*c)+r*(o*l-s*c)}transpose(){let e=this.elements,t;return t=e[1],e[1]=e[4],e[4]=t,t=e[2],e[2]=e[8],e[8]=t,t=e[6],e[6]=e[9],e[9]=t,t=e[3],e[3]=e[12],e[12]=t,t=e[7],e[7]=e[13],e[13]=t,t=e[11],e[11]=e[14],e[14]=t,this}setPosition(e,t,i){let r=this.elements;return e.isVector3?(r[12]=e.x,r[13]=e.y,r[14]=e.z):(r[12]=e,r[13]=t,r[14]=i),this}invert(){let e=this.elements,t=e[0],i=e[1],r=e[2],o=e[3],s=e[4],a=e[5],c=e[6],l=e[7],f=e[8],d=e[9],h=e[10],m=e[11],x=e[12],v=e[13],p=e[14],u=e[15],y=t*a-i*s,A=t*c-r*s,M=t*l-o*s,C=i*c-r*a,b=i*l-o*a,g=r*l-o*c,T=f*v-d*x,B=f*p-h*x,D=f*u-m*x,U=d*p-h*v,z=d*u-m*v,$=h*u-m*p,P=y*$-A*z+M*U+C*D-b*B+g*T;if(P===0)return this.set(0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0);let W=1/P;return e[0]=(a*$-c*z+l*U)*W,e[1]=(r*z-i*$-o*U)*W,e[2]=(v*g-p*b+u*C)*W,e[3]=(h*b-d*g-m*C)*W,e[4]=(c*D-s*$-l*B)*W,e[5]=(t*$-r*D+o*B)*W,e[6]=(p*M-x*g-u*A)*W,e[7]=(f*g-h*M+m*A)*W,e[8]=(s*z-a*D+l*T)*W,e[9]=(i*D-t*z-o*T)*W,e[10]=(x*b-v*M+u*y)*W,e[11]=(d*M-f*b-m*y)*W,e[12]=(a*B-s*U-c*T)*W,e[13]=(t*U-i*B+r*T)*W,e[14]=(v*A-x*C-p*y)*W,e[15]=(f*C-d*A+h*y)*W,this}scale(e){let t=this.elements,i=e.x,r=e.y,o=e.z;return t[0]*=i,t[4]*=r,t[8]*=o,t[1]*=i,t[5]*=r,t[9]*=o,t[2]*=i,t[6]*=r,t[10]*=o,t[3]*=i,t[7]*=r,t[11]*=o,this}getMaxScaleOnAxis(){let e=this.elements,t=e[0]*e[0]+e[1]*e[1]+e[2]*e[2],i=e[4]*e[4]+e[5]*e[5]+e[6]*e[6],r=e[8]*e[8]+e[9]*e[9]+e[10]*e[10];return Math.sqrt(Math.max(t,i,r))}makeTranslation(e,t,i){return e.isVector3?this.set(1,0,0,e.x,0,1,0,e.y,0,0,1,e.z,0,0,0,1):this.set(1,0,0,e,0,1,0,t,0,0,1,i,0,0,0,1),this}makeRotationX(e){let t=Math.cos(e),i=Math.sin(e);return this.set(1,0,0,0,0,t,-i,0,0,i,t,0,0,0,0,1),this}makeRotationY(e){let t=Math.cos(e),i=Math.sin(e);return this.set(t,0,i,0,0,1,0,0,-i,0,t,0,0,0,0,1),this}makeRotationZ(e){let t=Math.cos(e),i=Math.sin(e);return this.set(t,-i,0,0,i,t,0,0,0,0,1,0,0,0,0,1),this}makeRotationAxis(e,t){let i=Math.cos(t),r=Math.sin(t),o=1-i,s=e.x,a=e.y,c=e.z,l=o*s,f=o*a;return this.set(l*s+i,l*a-r*c,l*c+r*a,0,l*a+r*c,f*a+i,f*c-r*s,0,l*c-r*a,f*c+r*s,o*c*c+i,0,0,0,0,1),this}makeScale(e,t,i){return this.set(e,0,0,0,0,t,0,0,0,0,i,0,0,0,0,1),this}makeShear(e,t,i,r,o,s){return this.set(1,i,o,0,e,1,s,0,t,r,1,0,0,0,0,1),this}compose(e,t,i){let r=this.elements,o=t._x,s=t._y,a=t._z,c=t._w,l=o+o,f=s+s,d=a+a,h=o*l,m=o*f,x=o*d,v=s*f,p=s*d,u=a*d,y=c*l,A=c*f,M=c*d,C=i.x,b=i.y,g=i.z;return r[0]=(1-(v+u))*C,r[1]=(m+M)*C,r[2]=(x-A)*C,r[3]=0,r[4]=(m-M)*b,r[5]=(1-(h+u))*b,r[6]=(p+y)*b,r[7]=0,r[8]=(x+A)*g,r[9]=(p-y)*g,r[10]=(1-(h+v))*g,r[11]=0,r[12]=e.x,r[13]=e.y,r[14]=e.z,r[15]=1,this}decompose(e,t,i){let r=this.elements;e.x=r[12],e.y=r[13],e.z=r[14];let o=this.determinantAffine();if(o===0)return i.set(1,1,1),t.identity(),this;let s=Fn.set(r[0],r[1],r[2]).length(),a=Fn.set(r[4],r[5],r[6]).length(),c=Fn.set(r[8],r[9],r[10]).length();o<0&&(s=-s),xi.copy(this);let l=1/s,f=1/a,d=1/c;return xi.elements[0]*=l,xi.elements[1]*=l,xi.elements[2]*=l,xi.elements[4]*=f,xi.elements[5]*=f,xi.elements[6]*=f,xi.elements[8]*=d,xi.elements[9]*=d,xi.elements[10]*=d,t.setFromRotationMatrix(xi),i.x=s,i.y=a,i.z=c,this}makePerspective(e,t,i,r,o,s,a=wt,c=!1){let l=this.elements,f=2*o/(t-e),d=2*o/(i-r),h=(t+e)/(t-e),m=(i+r)/(i-r),x,v;if(c)x=o/(s-o),v=s*o/(s-o);else if(a===wt)x=-(s+o)/(s-o),v=-2*s*o/(s-o);else if(a===Pi)x=-s/(s-o),v=-s*o/(s-o);else throw new Error("THREE.Matrix4.makePerspective(): Invalid coordinate system: "+a);return l[0]=f,l[4]=0,l[8]=h,l[12]=0,l[1]=0,l[5]=d,l[9]=m,l[13]=0,l[2]=0,l[6]=0,l[10]=x,l[14]=v,l[3]=0,l[7]=0,l[11]=-1,l[15]=0,this}makeOrthographic(e,t,i,r,o,s,a=wt,c=!1){let l=this.elements,f=2/(t-e),d=2/(i-r),h=-(t+e)/(t-e),m=-(i+r)/(i-r),x,v;if(c)x=1/(s-o),v=s/(s-o);else if(a===wt)x=-2/(s-o),v=-(s+o)/(s-o);else if(a===Pi)x=-1/(s-o),v=-o/(s-o);else throw new Error("THREE.Matrix4.makeOrthographic(): Invalid coordinate system: "+a);return l[0]=f,l[4]=0,l[8]=0,l[12]=h,l[1]=0,l[5]=d,l[9]=0,l[13]=m,l[2]=0,l[6]=0,l[10]=x,l[14]=v,l[3]=0,l[7]=0,l[11]=0,l[15]=1,this}equals(e){let t=this.elements,i=e.elements;for(let r=0;r<16;r++)if(t[r]!==i[r])return!1;return!0}fromArray(e,t=0){for(let i=0;i<16;i++)this.elements[i]=e[i+t];return this}toArray(e=[],t=0){let i=this.elements;return e[t]=i[0],e[t+1]=i[1],e[t+2]=i[2],e[t+3]=i[3],e[t+4]=i[4],e[t+5]=i[5],e[t+6]=i[6],e[t+7]=i[7],e[t+8]=i[8],e[t+9]=i[9],e[t+10]=i[10],e[t+11]=i[11],e[t+12]=i[12],e[t+13]=i[13],e[t+14]=i[14],e[t+15]=i[15],e}},Fn=new I,xi=new we,Bd=new I(0,0,0),Gd=new I(1,1,1),Wi=new I,Wo=new I,ei=new I;var ql=new we,Yl=new Zt,Kt=class n{constructor(e=0,t=0,i=0,r=n.DEFAULT_ORDER){this.isEuler=!0,this._x=e,this._y=t,this._z=i,this._order=r}get x(){return this._x}set x(e){this._x=e,this._onChangeCallback()}get y(){return this._y}set y(e){this._y=e,this._onChangeCallback()}get z(){return this._z}set z(e){this._z=e,this._onChangeCallback()}get order(){return this._order}set order(e){this._order=e,this._onChangeCallback()}set(e,t,i,r=this._order){return this._x=e,this._y=t,this._z=i,this._order=r,this._onChangeCallback(),this}clone(){return new this.constructor(this._x,this._y,this._z,this._order)}copy(e){return this._x=e._x,this._y=e._y,this._z=e._z,this._order=e._order,this._onChangeCallback(),this}setFromRotationMatrix(e,t=this._order,i=!0){let r=e.elements,o=r[0],s=r[4],a=r[8],c=r[1],l=r[5],f=r[9],d=r[2],h=r[6],m=r[10];switch(t){case"XYZ":this._y=Math.asin(Pe(a,-1,1)),Math.abs(a)<.9999999?(this._x=Math.atan2(-f,m),this._z=Math.atan2(-s,o)):(this._x=Math.atan2(h,l),this._z=0);break;case"YXZ":this._x=Math.asin(-Pe(f,-1,1)),Math.abs(f)<.9999999?(this._y=Math.atan2(a,m),this._z=Math.atan2(c,l)):(this._y=Math.atan2(-d,o),this._z=0);break;case"ZXY":this._x=Math.asin(Pe(h,-1,1)),Math.abs(h)<.9999999?(this._y=Math.atan2(-d,m),this._z=Math.atan2(-s,l)):(this._y=0,this._z=Math.atan2(c,o));break;case"ZYX":this._y=Math.asin(-Pe(d,-1,1)),Math.abs(d)<.9999999?(this._x=Math.atan2(h,m),this._z=Math.atan2(c,o)):(this._x=0,this._z=Math.atan2(-s,l));break;case"YZX":this._z=Math.asin(Pe(c,-1,1)),Math.abs(c)<.9999999?(this._x=Math.atan2(-f,l),this._y=Math.atan2(-d,o)):(this._x=0,this._y=Math.atan2(a,m));break;case"XZY":this._z=Math.asin(-Pe(s,-1,1)),Math.abs(s)<.9999999?(this._x=Math.atan2(h,l),this._y=Math.atan2(a,o)):(this._x=Math.atan2(-f,m),this._y=0);break;default:pe("Euler: .setFromRotationMatrix() encountered an unknown order: "+t)}return this._order=t,i===!0&&this._onChangeCallback(),this}setFromQuaternion(e,t,i){return ql.makeRotationFromQuaternion(e),this.setFromRotationMatrix(ql,t,i)}setFromVector3(e,t=this._order){return this.set(e.x,e.y,e.z,t)}reorder(e){return Yl.setFromEuler(this),this.setFromQuaternion(Yl,e)}equals(e){return e._x===this._x&&e._y===this._y&&e._z===this._z&&e._order===this._order}fromArray(e){return this._x=e[0],this._y=e[1],this._z=e[2],e[3]!==void 0&&(this._order=e[3]),this._onChangeCallback(),this}toArray(e=[],t=0){return e[t]=this._x,e[t+1]=this._y,e[t+2]=this._z,e[t+3]=this._order,e}_onChange(e){return this._onChangeCallback=e,this}_onChangeCallback(){}*[Symbol.iterator](){yield this._x,yield this._y,yield this._z,yield this._order}};Kt.DEFAULT_ORDER="XYZ";var On=class{constructor(){this.mask=1}set(e){this.mask=(1<<e|0)>>>0}enable(e){this.mask|=1<<e|0}enableAll(){this.mask=-1}toggle(e){this.mask^=1<<e|0}disable(e){this.mask&=~(1<<e|0)}disableAll(){this.mask=0}test(e){return(this.mask&e.mask)!==0}isEnabled(e){return(this.mask&(1<<e|0))!==0}};var zd=0,Zl=new I,Bn=new Zt,Li=new we,Xo=new I,to=new I,Hd=new I,Vd=new Zt,Kl=new I(1,0,0),Jl=new I(0,1,0),$l=new I(0,0,1),Ql={type:"added"},kd={type:"removed"},Gn={type:"childadded",child:null},ua={type:"childremoved",child:null},Xe=class n extends yt{constructor(){super(),this.isObject3D=!0,Object.defineProperty(this,"id",{value:zd++}),this.uuid=gi(),this.name="",this.type="Object3D",this.parent=null,this.children=[],this.up=n.DEFAULT_UP.clone();let e=new I,t=new Kt,i=new Zt,r=new I(1,1,1);function o(){i.setFromEuler(t,!1)}function s(){t.setFromQuaternion(i,void 0,!1)}t._onChange(o),i._onChange(s),Object.defineProperties(this,{position:{configurable:!0,enumerable:!0,value:e},rotation:{configurable:!0,enumerable:!0,value:t},quaternion:{configurable:!0,enumerable:!0,value:i},scale:{configurable:!0,enumerable:!0,value:r},modelViewMatrix:{value:new we},normalMatrix:{value:new Ee}}),this.matrix=new we,this.matrixWorld=new we,this.matrixAutoUpdate=n.DEFAULT_MATRIX_AUTO_UPDATE,this.matrixWorldAutoUpdate=n.DEFAULT_MATRIX_WORLD_AUTO_UPDATE,this.matrixWorldNeedsUpdate=!1,this.layers=new On,this.visible=!0,this.castShadow=!1,this.receiveShadow=!1,this.frustumCulled=!0,this.renderOrder=0,this.animations=[],this.customDepthMaterial=void 0,this.customDistanceMaterial=void 0,this.static=!1,this.userData={},this.pivot=null}onBeforeShadow(){}onAfterShadow(){}onBeforeRender(){}onAfterRender(){}applyMatrix4(e){this.matrixAutoUpdate&&this.updateMatrix(),this.matrix.premultiply(e),this.matrix.decompose(this.position,this.quaternion,this.scale),this.pivot!==null&&this.position.copy(this.pivot).applyMatrix4(this.matrix).sub(this.pivot)}applyQuaternion(e){return this.quaternion.premultiply(e),this}setRotationFromAxisAngle(e,t){this.quaternion.setFromAxisAngle(e,t)}setRotationFromEuler(e){this.quaternion.setFromEuler(e,!0)}setRotationFromMatrix(e){this.quaternion.setFromRotationMatrix(e)}setRotationFromQuaternion(e){this.quaternion.copy(e)}rotateOnAxis(e,t){return Bn.setFromAxisAngle(e,t),this.quaternion.multiply(Bn),this}rotateOnWorldAxis(e,t){return Bn.setFromAxisAngle(e,t),this.quaternion.premultiply(Bn),this}rotateX(e){return this.rotateOnAxis(Kl,e)}rotateY(e){return this.rotateOnAxis(Jl,e)}rotateZ(e){return this.rotateOnAxis($l,e)}translateOnAxis(e,t){return Zl.copy(e).applyQuaternion(this.quaternion),this.position.add(Zl.multiplyScalar(t)),this}translateX(e){return this.translateOnAxis(Kl,e)}translateY(e){return this.translateOnAxis(Jl,e)}translateZ(e){return this.translateOnAxis($l,e)}localToWorld(e){return this.updateWorldMatrix(!0,!1),e.applyMatrix4(this.matrixWorld)}worldToLocal(e){return this.updateWorldMatrix(!0,!1),e.applyMatrix4(Li.copy(this.matrixWorld).invert())}lookAt(e,t,i){e.isVector3?Xo.copy(e):Xo.set(e,t,i);let r=this.parent;this.updateWorldMatrix(!0,!1),to.setFromMatrixPosition(this.matrixWorld),this.isCamera||this.isLight?Li.lookAt(to,Xo,this.up):Li.lookAt(Xo,to,this.up),this.quaternion.setFromRotationMatrix(Li),r&&(Li.extractRotation(r.matrixWorld),Bn.setFromRotationMatrix(Li),this.quaternion.premultiply(Bn.invert()))}add(e){if(arguments.length>1){for(let t=0;t<arguments.length;t++)this.add(arguments[t]);return this}return e===this?(Oe("Object3D.add: object can't be added as a child of itself.",e),this):(e&&e.isObject3D?(e.removeFromParent(),e.parent=this,this.children.push(e),e.dispatchEvent(Ql),Gn.child=e,this.dispatchEvent(Gn),Gn.child=null):Oe("Object3D.add: object not an instance of THREE.Object3D.",e),this)}remove(e){if(arguments.length>1){for(let i=0;i<arguments.length;i++)this.remove(arguments[i]);return this}let t=this.children.indexOf(e);return t!==-1&&(e.parent=null,this.children.splice(t,1),e.dispatchEvent(kd),ua.child=e,this.dispatchEvent(ua),ua.child=null),this}removeFromParent(){let e=this.parent;return e!==null&&e.remove(this),this}clear(){return this.remove(...this.children)}attach(e){return this.updateWorldMatrix(!0,!1),Li.copy(this.matrixWorld).invert(),e.parent!==null&&(e.parent.updateWorldMatrix(!0,!1),Li.multiply(e.parent.matrixWorld)),e.applyMatrix4(Li),e.removeFromParent(),e.parent=this,this.children.push(e),e.updateWorldMatrix(!1,!0),e.dispatchEvent(Ql),Gn.child=e,this.dispatchEvent(Gn),Gn.child=null,this}getObjectById(e){return this.getObjectByProperty("id",e)}getObjectByName(e){return this.getObjectByProperty("name",e)}getObjectByProperty(e,t){if(this[e]===t)return this;for(let i=0,r=this.children.length;i<r;i++){let s=this.children[i].getObjectByProperty(e,t);if(s!==void 0)return s}}getObjectsByProperty(e,t,i=[]){this[e]===t&&i.push(this);let r=this.children;for(let o=0,s=r.length;o<s;o++)r[o].getObjectsByProperty(e,t,i);return i}getWorldPosition(e){return this.updateWorldMatrix(!0,!1),e.setFromMatrixPosition(this.matrixWorld)}getWorldQuaternion(e){return this.updateWorldMatrix(!0,!1),this.matrixWorld.decompose(to,e,Hd),e}getWorldScale(e){return this.updateWorldMatrix(!0,!1),this.matrixWorld.decompose(to,Vd,e),e}getWorldDirection(e){this.updateWorldMatrix(!0,!1);let t=this.matrixWorld.elements;return e.set(t[8],t[9],t[10]).normalize()}raycast(){}intersectsFrustum(){return!0}traverse(e){e(this);let t=this.children;for(let i=0,r=t.length;i<r;i++)t[i].traverse(e)}traverseVisible(e){if(this.visible===!1)return;e(this);let t=this.children;for(let i=0,r=t.length;i<r;i++)t[i].traverseVisible(e)}traverseAncestors(e){let t=this.parent;t!==null&&(e(t),t.traverseAncestors(e))}updateMatrix(){this.matrix.compose(this.position,this.quaternion,this.scale);let e=this.pivot;if(e!==null){let t=e.x,i=e.y,r=e.z,o=this.matrix.elements;o[12]+=t-o[0]*t-o[4]*i-o[8]*r,o[13]+=i-o[1]*t-o[5]*i-o[9]*r,o[14]+=r-o[2]*t-o[6]*i-o[10]*r}this.matrixWorldNeedsUpdate=!0}updateMatrixWorld(e){this.matrixAutoUpdate&&this.updateMatrix(),(this.matrixWorldNeedsUpdate||e)&&(this.matrixWorldAutoUpdate===!0&&(this.parent===null?this.matrixWorld.copy(this.matrix):this.matrixWorld.multiplyMatrices(this.parent.matrixWorld,this.matrix)),this.matrixWorldNeedsUpdate=!1,e=!0);let t=this.children;for(let i=0,r=t.length;i<r;i++)t[i].updateMatrixWorld(e)}updateWorldMatrix(e,t,i=!1){let r=this.parent;if(e===!0&&r!==null&&r.updateWorldMatrix(!0,!1),this.matrixAutoUpdate&&this.updateMatrix(),(this.matrixWorldNeedsUpdate||i)&&(this.matrixWorldAutoUpdate===!0&&(this.parent===null?this.matrixWorld.copy(this.matrix):this.matrixWorld.multiplyMatrices(this.parent.matrixWorld,this.matrix)),this.matrixWorldNeedsUpdate=!1,i=!0),t===!0){let o=this.children;for(let s=0,a=o.length;s<a;s++)o[s].updateWorldMatrix(!1,!0,i)}}toJSON(e){let t=e===void 0||typeof e=="string",i={};t&&(e={geometries:{},materials:{},textures:{},images:{},shapes:{},skeletons:{},animations:{},nodes:{}},i.metadata={version:4.7,type:"Object",generator:"Object3D.toJSON"});let r={};r.uuid=this.uuid,r.type=this.type,r.name=this.name,r.castShadow=this.castShadow,r.receiveShadow=this.receiveShadow,r.visible=this.visible,r.frustumCulled=this.frustumCulled,r.renderOrder=this.renderOrder,r.static=this.static,r.matrixAutoUpdate=this.matrixAutoUpdate,Object.keys(this.userData).length>0&&(r.userData=this.userData),r.layers=this.layers.mask,r.matrix=this.matrix.toArray(),r.up=this.up.toArray(),this.pivot!==null&&(r.pivot=this.pivot.toArray()),this.morphTargetDictionary!==void 0&&(r.morphTargetDictionary=Object.assign({},this.morphTargetDictionary)),this.morphTargetInfluences!==void 0&&(r.morphTargetInfluences=this.morphTargetInfluences.slice()),this.isInstancedMesh&&(r.type="InstancedMesh",r.count=this.count,r.instanceMatrix=this.instanceMatrix.toJSON(),this.instanceColor!==null&&(r.instanceColor=this.instanceColor.toJSON())),this.isBatchedMesh&&(r.type="BatchedMesh",r.perObjectFrustumCulled=this.perObjectFrustumCulled,r.sortObjects=this.sortObjects,r.drawRanges=this._drawRanges,r.reservedRanges=this._reservedRanges,r.geometryInfo=this._geometryInfo.map(a=>({...a,boundingBox:a.boundingBox?a.boundingBox.toJSON():void 0,boundingSphere:a.boundingSphere?a.boundingSphere.toJSON():void 0})),r.instanceInfo=this._instanceInfo.map(a=>({...a})),r.availableInstanceIds=this._availableInstanceIds.slice(),r.availableGeometryIds=this._availableGeometryIds.slice(),r.nextIndexStart=this._nextIndexStart,r.nextVertexStart=this._nextVertexStart,r.geometryCount=this._geometryCount,r.maxInstanceCount=this._maxInstanceCount,r.maxVertexCount=this._maxVertexCount,r.maxIndexCount=this._maxIndexCount,r.geometryInitialized=this._geometryInitialized,r.matricesTexture=this._matricesTexture.toJSON(e),r.indirectTexture=this._indirectTexture.toJSON(e),this._colorsTexture!==null&&(r.colorsTexture=this._colorsTexture.toJSON(e)),this.boundingSphere!==null&&(r.boundingSphere=this.boundingSphere.toJSON()),this.boundingBox!==null&&(r.boundingBox=this.boundingBox.toJSON()));function o(a,c){return a[c.uuid]===void 0&&(a[c.uuid]=c.toJSON(e)),c.uuid}if(this.isScene)this.background&&(this.background.isColor?r.background=this.background.toJSON():this.background.isTexture&&(r.background=this.background.toJSON(e).uuid)),this.environment&&this.environment.isTexture&&this.environment.isRenderTargetTexture!==!0&&(r.environment=this.environment.toJSON(e).uuid);else if(this.isMesh||this.isLine||this.isPoints){r.geometry=o(e.geometries,this.geometry);let a=this.geometry.parameters;if(a!==void 0&&a.shapes!==void 0){let c=a.shapes;if(Array.isArray(c))for(let l=0,f=c.length;l<f;l++){let d=c[l];o(e.shapes,d)}else o(e.shapes,c)}}if(this.isSkinnedMesh&&(r.bindMode=this.bindMode,r.bindMatrix=this.bindMatrix.toArray(),this.skeleton!==void 0&&(o(e.skeletons,this.skeleton),r.skeleton=this.skeleton.uuid)),this.material!==void 0)if(Array.isArray(this.material)){let a=[];for(let c=0,l=this.material.length;c<l;c++)a.push(o(e.materials,this.material[c]));r.material=a}else r.material=o(e.materials,this.material);if(this.children.length>0){r.children=[];for(let a=0;a<this.children.length;a++)r.children.push(this.children[a].toJSON(e).object)}if(this.animations.length>0){r.animations=[];for(let a=0;a<this.animations.length;a++){let c=this.animations[a];r.animations.push(o(e.animations,c))}}if(t){let a=s(e.geometries),c=s(e.materials),l=s(e.textures),f=s(e.images),d=s(e.shapes),h=s(e.skeletons),m=s(e.animations),x=s(e.nodes);a.length>0&&(i.geometries=a),c.length>0&&(i.materials=c),l.length>0&&(i.textures=l),f.length>0&&(i.images=f),d.length>0&&(i.shapes=d),h.length>0&&(i.skeletons=h),m.length>0&&(i.animations=m),x.length>0&&(i.nodes=x)}return i.object=r,i;function s(a){let c=[];for(let l in a){let f=a[l];delete f.metadata,c.push(f)}return c}}clone(e){return new this.constructor().copy(this,e)}copy(e,t=!0){if(this.name=e.name,this.up.copy(e.up),this.position.copy(e.position),this.rotation.order=e.rotation.order,this.quaternion.copy(e.quaternion),this.scale.copy(e.scale),this.pivot=e.pivot!==null?e.pivot.clone():null,this.matrix.copy(e.matrix),this.matrixWorld.copy(e.matrixWorld),this.matrixAutoUpdate=e.matrixAutoUpdate,this.matrixWorldAutoUpdate=e.matrixWorldAutoUpdate,this.matrixWorldNeedsUpdate=e.matrixWorldNeedsUpdate,this.layers.mask=e.layers.mask,this.visible=e.visible,this.castShadow=e.castShadow,this.receiveShadow=e.receiveShadow,this.frustumCulled=e.frustumCulled,this.renderOrder=e.renderOrder,this.static=e.static,this.animations=e.animations.slice(),this.userData=JSON.parse(JSON.stringify(e.userData)),t===!0)for(let i=0;i<e.children.length;i++){let r=e.children[i];this.add(r.clone())}return this}dispose(){this.dispatchEvent({type:"dispose"})}};Xe.DEFAULT_UP=new I(0,1,0);Xe.DEFAULT_MATRIX_AUTO_UPDATE=!0;Xe.DEFAULT_MATRIX_WORLD_AUTO_UPDATE=!0;var qo=class extends Xe{constructor(){super(),this.isGroup=!0,this.type="Group"}};var jl={aliceblue:15792383,antiquewhite:16444375,aqua:65535,aquamarine:8388564,azure:15794175,beige:16119260,bisque:16770244,black:0,blanchedalmond:16772045,blue:255,blueviolet:9055202,brown:10824234,burlywood:14596231,cadetblue:6266528,chartreuse:8388352,chocolate:13789470,coral:16744272,cornflowerblue:6591981,cornsilk:16775388,crimson:14423100,cyan:65535,darkblue:139,darkcyan:35723,darkgoldenrod:12092939,darkgray:11119017,darkgreen:25600,darkgrey:11119017,darkkhaki:12433259,darkmagenta:9109643,darkolivegreen:5597999,darkorange:16747520,darkorchid:10040012,darkred:9109504,darksalmon:15308410,darkseagreen:9419919,darkslateblue:4734347,darkslategray:3100495,darkslategrey:3100495,darkturquoise:52945,darkviolet:9699539,deeppink:16716947,deepskyblue:49151,dimgray:6908265,dimgrey:6908265,dodgerblue:2003199,firebrick:11674146,floralwhite:16775920,forestgreen:2263842,fuchsia:16711935,gainsboro:14474460,ghostwhite:16316671,gold:16766720,goldenrod:14329120,gray:8421504,green:32768,greenyellow:11403055,grey:8421504,honeydew:15794160,hotpink:16738740,indianred:13458524,indigo:4915330,ivory:16777200,khaki:15787660,lavender:15132410,lavenderblush:16773365,lawngreen:8190976,lemonchiffon:16775885,lightblue:11393254,lightcoral:15761536,lightcyan:14745599,lightgoldenrodyellow:16448210,lightgray:13882323,lightgreen:9498256,lightgrey:13882323,lightpink:16758465,lightsalmon:16752762,lightseagreen:2142890,lightskyblue:8900346,lightslategray:7833753,lightslategrey:7833753,lightsteelblue:11584734,lightyellow:16777184,lime:65280,limegreen:3329330,linen:16445670,magenta:16711935,maroon:8388608,mediumaquamarine:6737322,mediumblue:205,mediumorchid:12211667,mediumpurple:9662683,mediumseagreen:3978097,mediumslateblue:8087790,mediumspringgreen:64154,mediumturquoise:4772300,mediumvioletred:13047173,midnightblue:1644912,mintcream:16121850,mistyrose:16770273,moccasin:16770229,navajowhite:16768685,navy:128,oldlace:16643558,olive:8421376,olivedrab:7048739,orange:16753920,orangered:16729344,orchid:14315734,palegoldenrod:15657130,palegreen:10025880,paleturquoise:11529966,palevioletred:14381203,papayawhip:16773077,peachpuff:16767673,peru:13468991,pink:16761035,plum:14524637,powderblue:11591910,purple:8388736,rebeccapurple:6697881,red:16711680,rosybrown:12357519,royalblue:4286945,saddlebrown:9127187,salmon:16416882,sandybrown:16032864,seagreen:3050327,seashell:16774638,sienna:10506797,silver:12632256,skyblue:8900331,slateblue:6970061,slategray:7372944,slategrey:7372944,snow:16775930,springgreen:65407,steelblue:4620980,tan:13808780,teal:32896,thistle:14204888,tomato:16737095,turquoise:4251856,violet:15631086,wheat:16113331,white:16777215,whitesmoke:16119285,yellow:16776960,yellowgreen:10145074},Xi={h:0,s:0,l:0},Yo={h:0,s:0,l:0};function ha(n,e,t){return t<0&&(t+=1),t>1&&(t-=1),t<1/6?n+(e-n)*6*t:t<1/2?e:t<2/3?n+(e-n)*6*(2/3-t):n}var Me=class{constructor(e,t,i){return this.isColor=!0,this.r=1,this.g=1,this.b=1,this.set(e,t,i)}set(e,t,i){if(t===void 0&&i===void 0){let r=e;r&&r.isColor?this.copy(r):typeof r=="number"?this.setHex(r):typeof r=="string"&&this.setStyle(r)}else this.setRGB(e,t,i);return this}setScalar(e){return this.r=e,this.g=e,this.b=e,this}setHex(e,t=Ht){return e=Math.floor(e),this.r=(e>>16&255)/255,this.g=(e>>8&255)/255,this.b=(e&255)/255,Re.colorSpaceToWorking(this,t),this}setRGB(e,t,i,r=Re.workingColorSpace){return this.r=e,this.g=t,this.b=i,Re.colorSpaceToWorking(this,r),this}setHSL(e,t,i,r=Re.workingColorSpace){if(e=Go(e,1),t=Pe(t,0,1),i=Pe(i,0,1),t===0)this.r=this.g=this.b=i;else{let o=i<=.5?i*(1+t):i+t-i*t,s=2*i-o;this.r=ha(s,o,e+1/3),this.g=ha(s,o,e),this.b=ha(s,o,e-1/3)}return Re.colorSpaceToWorking(this,r),this}setStyle(e,t=Ht){function i(o){o!==void 0&&parseFloat(o)<1&&pe("Color: Alpha component of "+e+" will be ignored.")}let r;if(r=/^(\w+)\(([^\)]*)\)/.exec(e)){let o,s=r[1],a=r[2];switch(s){case"rgb":case"rgba":if(o=/^\s*(\d+)\s*,\s*(\d+)\s*,\s*(\d+)\s*(?:,\s*(\d+(?:\.\d+)?|\.\d+)\s*)?$/.exec(a))return i(o[4]),this.setRGB(Math.min(255,parseInt(o[1],10))/255,Math.min(255,parseInt(o[2],10))/255,Math.min(255,parseInt(o[3],10))/255,t);if(o=/^\s*(\d+(?:\.\d+)?|\.\d+)\%\s*,\s*(\d+(?:\.\d+)?|\.\d+)\%\s*,\s*(\d+(?:\.\d+)?|\.\d+)\%\s*(?:,\s*(\d+(?:\.\d+)?|\.\d+)\s*)?$/.exec(a))return i(o[4]),this.setRGB(Math.min(100,parseFloat(o[1]))/100,Math.min(100,parseFloat(o[2]))/100,Math.min(100,parseFloat(o[3]))/100,t);break;case"hsl":case"hsla":if(o=/^\s*([+-]?(?:\d+(?:\.\d+)?|\.\d+))\s*,\s*(\d+(?:\.\d+)?|\.\d+)\%\s*,\s*(\d+(?:\.\d+)?|\.\d+)\%\s*(?:,\s*(\d+(?:\.\d+)?|\.\d+)\s*)?$/.exec(a))return i(o[4]),this.setHSL(parseFloat(o[1])/360,parseFloat(o[2])/100,parseFloat(o[3])/100,t);break;default:pe("Color: Unknown color model "+e)}}else if(r=/^\#([A-Fa-f\d]+)$/.exec(e)){let o=r[1],s=o.length;if(s===3)return this.setRGB(parseInt(o.charAt(0),16)/15,parseInt(o.charAt(1),16)/15,parseInt(o.charAt(2),16)/15,t);if(s===6)return this.setHex(parseInt(o,16),t);pe("Color: Invalid hex color "+e)}else if(e&&e.length>0)return this.setColorName(e,t);return this}setColorName(e,t=Ht){let i=jl[e.toLowerCase()];return i!==void 0?this.setHex(i,t):pe("Color: Unknown color "+e),this}clone(){return new this.constructor(this.r,this.g,this.b)}copy(e){return this.r=e.r,this.g=e.g,this.b=e.b,this}copySRGBToLinear(e){return this.r=_i(e.r),this.g=_i(e.g),this.b=_i(e.b),this}copyLinearToSRGB(e){return this.r=un(e.r),this.g=un(e.g),this.b=un(e.b),this}convertSRGBToLinear(){return this.copySRGBToLinear(this),this}convertLinearToSRGB(){return this.copyLinearToSRGB(this),this}getHex(e=Ht){return Re.workingToColorSpace(Ft.copy(this),e),Math.round(Pe(Ft.r*255,0,255))*65536+Math.round(Pe(Ft.g*255,0,255))*256+Math.round(Pe(Ft.b*255,0,255))}getHexString(e=Ht){return("000000"+this.getHex(e).toString(16)).slice(-6)}getHSL(e,t=Re.workingColorSpace){Re.workingToColorSpace(Ft.copy(this),t);let i=Ft.r,r=Ft.g,o=Ft.b,s=Math.max(i,r,o),a=Math.min(i,r,o),c,l,f=(a+s)/2;if(a===s)c=0,l=0;else{let d=s-a;switch(l=f<=.5?d/(s+a):d/(2-s-a),s){case i:c=(r-o)/d+(r<o?6:0);break;case r:c=(o-i)/d+2;break;case o:c=(i-r)/d+4;break}c/=6}return e.h=c,e.s=l,e.l=f,e}getRGB(e,t=Re.workingColorSpace){return Re.workingToColorSpace(Ft.copy(this),t),e.r=Ft.r,e.g=Ft.g,e.b=Ft.b,e}getStyle(e=Ht){Re.workingToColorSpace(Ft.copy(this),e);let t=Ft.r,i=Ft.g,r=Ft.b;return e!==Ht?`color(${e} ${t.toFixed(3)} ${i.toFixed(3)} ${r.toFixed(3)})`:`rgb(${Math.round(t*255)},${Math.round(i*255)},${Math.round(r*255)})`}offsetHSL(e,t,i){return this.getHSL(Xi),this.setHSL(Xi.h+e,Xi.s+t,Xi.l+i)}add(e){return this.r+=e.r,this.g+=e.g,this.b+=e.b,this}addColors(e,t){return this.r=e.r+t.r,this.g=e.g+t.g,this.b=e.b+t.b,this}addScalar(e){return this.r+=e,this.g+=e,this.b+=e,this}sub(e){return this.r=Math.max(0,this.r-e.r),this.g=Math.max(0,this.g-e.g),this.b=Math.max(0,this.b-e.b),this}multiply(e){return this.r*=e.r,this.g*=e.g,this.b*=e.b,this}multiplyScalar(e){return this.r*=e,this.g*=e,this.b*=e,this}lerp(e,t){return this.r+=(e.r-this.r)*t,this.g+=(e.g-this.g)*t,this.b+=(e.b-this.b)*t,this}lerpColors(e,t,i){return this.r=e.r+(t.r-e.r)*i,this.g=e.g+(t.g-e.g)*i,this.b=e.b+(t.b-e.b)*i,this}lerpHSL(e,t){this.getHSL(Xi),e.getHSL(Yo);let i=In(Xi.h,Yo.h,t),r=In(Xi.s,Yo.s,t),o=In(Xi.l,Yo.l,t);return this.setHSL(i,r,o),this}setFromVector3(e){return this.r=e.x,this.g=e.y,this.b=e.z,this}applyMatrix3(e){let t=this.r,i=this.g,r=this.b,o=e.elements;return this.r=o[0]*t+o[3]*i+o[6]*r,this.g=o[1]*t+o[4]*i+o[7]*r,this.b=o[2]*t+o[5]*i+o[8]*r,this}equals(e){return e.r===this.r&&e.g===this.g&&e.b===this.b}fromArray(e,t=0){return this.r=e[t],this.g=e[t+1],this.b=e[t+2],this}toArray(e=[],t=0){return e[t]=this.r,e[t+1]=this.g,e[t+2]=this.b,e}fromBufferAttribute(e,t){return this.r=e.getX(t),this.g=e.getY(t),this.b=e.getZ(t),this}toJSON(){return this.getHex()}*[Symbol.iterator](){yield this.r,yield this.g,yield this.b}},Ft=new Me;Me.NAMES=jl;var Zo=class n{constructor(e,t=1,i=1e3){this.isFog=!0,this.name="",this.color=new Me(e),this.near=t,this.far=i}clone(){return new n(this.color,this.near,this.far)}toJSON(){return{type:"Fog",name:this.name,color:this.color.getHex(),near:this.near,far:this.far}}};var Ko=class extends Xe{constructor(){super(),this.isScene=!0,this.type="Scene",this.background=null,this.environment=null,this.fog=null,this.backgroundBlurriness=0,this.backgroundIntensity=1,this.backgroundRotation=new Kt,this.environmentIntensity=1,this.environmentRotation=new Kt,this.overrideMaterial=null,typeof __THREE_DEVTOOLS__<"u"&&__THREE_DEVTOOLS__.dispatchEvent(new CustomEvent("observe",{detail:this}))}copy(e,t){return super.copy(e,t),this.background=e.background!==null?e.background.clone():null,this.environment=e.environment!==null?e.environment.clone():null,this.fog=e.fog!==null?e.fog.clone():null,this.backgroundBlurriness=e.backgroundBlurriness,this.backgroundIntensity=e.backgroundIntensity,this.backgroundRotation.copy(e.backgroundRotation),this.environmentIntensity=e.environmentIntensity,this.environmentRotation.copy(e.environmentRotation),this.overrideMaterial=e.overrideMaterial!==null?e.overrideMaterial.clone():null,this.matrixAutoUpdate=e.matrixAutoUpdate,this}toJSON(e){let t=super.toJSON(e);return this.fog!==null&&(t.object.fog=this.fog.toJSON()),t.object.backgroundBlurriness=this.backgroundBlurriness,t.object.backgroundIntensity=this.backgroundIntensity,t.object.backgroundRotation=this.backgroundRotation.toArray(),t.object.environmentIntensity=this.environmentIntensity,t.object.environmentRotation=this.environmentRotation.toArray(),t}};var Si=new I,Di=new I,da=new I,Ii=new I,zn=new I,Hn=new I,ec=new I,pa=new I,ma=new I,ga=new I,_a=new We,xa=new We,Sa=new We,qi=class n{constructor(e=new I,t=new I,i=new I){this.a=e,this.b=t,this.c=i}static getNormal(e,t,i,r){r.subVectors(i,t),Si.subVectors(e,t),r.cross(Si);let o=r.lengthSq();return o>0?r.multiplyScalar(1/Math.sqrt(o)):r.set(0,0,0)}static getBarycoord(e,t,i,r,o){Si.subVectors(r,t),Di.subVectors(i,t),da.subVectors(e,t);let s=Si.dot(Si),a=Si.dot(Di),c=Si.dot(da),l=Di.dot(Di),f=Di.dot(da),d=s*l-a*a;if(d===0)return o.set(0,0,0),null;let h=1/d,m=(l*c-a*f)*h,x=(s*f-a*c)*h;return o.set(1-m-x,x,m)}static containsPoint(e,t,i,r){return this.getBarycoord(e,t,i,r,Ii)===null?!1:Ii.x>=0&&Ii.y>=0&&Ii.x+Ii.y<=1}static getInterpolation(e,t,i,r,o,s,a,c){return this.getBarycoord(e,t,i,r,Ii)===null?(c.x=0,c.y=0,"z"in c&&(c.z=0),"w"in c&&(c.w=0),null):(c.setScalar(0),c.addScaledVector(o,Ii.x),c.addScaledVector(s,Ii.y),c.addScaledVector(a,Ii.z),c)}static getInterpolatedAttribute(e,t,i,r,o,s){return _a.setScalar(0),xa.setScalar(0),Sa.setScalar(0),_a.fromBufferAttribute(e,t),xa.fromBufferAttribute(e,i),Sa.fromBufferAttribute(e,r),s.setScalar(0),s.addScaledVector(_a,o.x),s.addScaledVector(xa,o.y),s.addScaledVector(Sa,o.z),s}static isFrontFacing(e,t,i,r){return Si.subVectors(i,t),Di.subVectors(e,t),Si.cross(Di).dot(r)<0}set(e,t,i){return this.a.copy(e),this.b.copy(t),this.c.copy(i),this}setFromPointsAndIndices(e,t,i,r){return this.a.copy(e[t]),this.b.copy(e[i]),this.c.copy(e[r]),this}setFromAttributeAndIndices(e,t,i,r){return this.a.fromBufferAttribute(e,t),this.b.fromBufferAttribute(e,i),this.c.fromBufferAttribute(e,r),this}clone(){return new this.constructor().copy(this)}copy(e){return this.a.copy(e.a),this.b.copy(e.b),this.c.copy(e.c),this}getArea(){return Si.subVectors(this.c,this.b),Di.subVectors(this.a,this.b),Si.cross(Di).length()*.5}getMidpoint(e){return e.addVectors(this.a,this.b).add(this.c).multiplyScalar(1/3)}getNormal(e){return n.getNormal(this.a,this.b,this.c,e)}getPlane(e){return e.setFromCoplanarPoints(this.a,this.b,this.c)}getBarycoord(e,t){return n.getBarycoord(e,this.a,this.b,this.c,t)}getInterpolation(e,t,i,r,o){return n.getInterpolation(e,this.a,this.b,this.c,t,i,r,o)}containsPoint(e){return n.containsPoint(e,this.a,this.b,this.c)}isFrontFacing(e){return n.isFrontFacing(this.a,this.b,this.c,e)}intersectsBox(e){return e.intersectsTriangle(this)}closestPointToPoint(e,t){let i=this.a,r=this.b,o=this.c,s,a;zn.subVectors(r,i),Hn.subVectors(o,i),pa.subVectors(e,i);let c=zn.dot(pa),l=Hn.dot(pa);if(c<=0&&l<=0)return t.copy(i);ma.subVectors(e,r);let f=zn.dot(ma),d=Hn.dot(ma);if(f>=0&&d<=f)return t.copy(r);let h=c*d-f*l;if(h<=0&&c>=0&&f<=0&&c-f>0)return s=c/(c-f),t.copy(i).addScaledVector(zn,s);ga.subVectors(e,o);let m=zn.dot(ga),x=Hn.dot(ga);if(x>=0&&m<=x)return t.copy(o);let v=m*l-c*x;if(v<=0&&l>=0&&x<=0)return a=l/(l-x),t.copy(i).addScaledVector(Hn,a);let p=f*x-m*d;if(p<=0&&d-f>=0&&m-x>=0)return ec.subVectors(o,r),a=(d-f)/(d-f+(m-x)),t.copy(r).addScaledVector(ec,a);let u=1/(p+v+h);return s=v*u,a=h*u,t.copy(i).addScaledVector(zn,s).addScaledVector(Hn,a)}equals(e){return e.a.equals(this.a)&&e.b.equals(this.b)&&e.c.equals(this.c)}};var Jt=class{constructor(e=new I(1/0,1/0,1/0),t=new I(-1/0,-1/0,-1/0)){this.isBox3=!0,this.min=e,this.max=t}set(e,t){return this.min.copy(e),this.max.copy(t),this}setFromArray(e){this.makeEmpty();for(let t=0,i=e.length;t<i;t+=3)this.expandByPoint(Mi.fromArray(e,t));return this}setFromBufferAttribute(e){this.makeEmpty();for(let t=0,i=e.count;t<i;t++)this.expandByPoint(Mi.fromBufferAttribute(e,t));return this}setFromPoints(e){this.makeEmpty();for(let t=0,i=e.length;t<i;t++)this.expandByPoint(e[t]);return this}setFromCenterAndSize(e,t){let i=Mi.copy(t).multiplyScalar(.5);return this.min.copy(e).sub(i),this.max.copy(e).add(i),this}setFromObject(e,t=!1){return this.makeEmpty(),this.expandByObject(e,t)}clone(){return new this.constructor().copy(this)}copy(e){return this.min.copy(e.min),this.max.copy(e.max),this}makeEmpty(){return this.min.x=this.min.y=this.min.z=1/0,this.max.x=this.max.y=this.max.z=-1/0,this}isEmpty(){return this.max.x<this.min.x||this.max.y<this.min.y||this.max.z<this.min.z}getCenter(e){return this.isEmpty()?e.set(0,0,0):e.addVectors(this.min,this.max).multiplyScalar(.5)}getSize(e){return this.isEmpty()?e.set(0,0,0):e.subVectors(this.max,this.min)}expandByPoint(e){return this.min.min(e),this.max.max(e),this}expandByVector(e){return this.min.sub(e),this.max.add(e),this}expandByScalar(e){return this.min.addScalar(-e),this.max.addScalar(e),this}expandByObject(e,t=!1){e.updateWorldMatrix(!1,!1);let i=e.geometry;if(i!==void 0){let o=i.getAttribute("position");if(t===!0&&o!==void 0&&e.isInstancedMesh!==!0&&e.isBatchedMesh!==!0)for(let s=0,a=o.count;s<a;s++)e.isMesh===!0?e.getVertexPosition(s,Mi):Mi.fromBufferAttribute(o,s),Mi.applyMatrix4(e.matrixWorld),this.expandByPoint(Mi);else e.boundingBox!==void 0?(e.boundingBox===null&&e.computeBoundingBox(),Jo.copy(e.boundingBox)):(i.boundingBox===null&&i.computeBoundingBox(),Jo.copy(i.boundingBox)),Jo.applyMatrix4(e.matrixWorld),this.union(Jo)}let r=e.children;for(let o=0,s=r.length;o<s;o++)this.expandByObject(r[o],t);return this}containsPoint(e){return e.x>=this.min.x&&e.x<=this.max.x&&e.y>=this.min.y&&e.y<=this.max.y&&e.z>=this.min.z&&e.z<=this.max.z}containsBox(e){return this.min.x<=e.min.x&&e.max.x<=this.max.x&&this.min.y<=e.min.y&&e.max.y<=this.max.y&&this.min.z<=e.min.z&&e.max.z<=this.max.z}getParameter(e,t){return t.set((e.x-this.min.x)/(this.max.x-this.min.x),(e.y-this.min.y)/(this.max.y-this.min.y),(e.z-this.min.z)/(this.max.z-this.min.z))}intersectsBox(e){return e.max.x>=this.min.x&&e.min.x<=this.max.x&&e.max.y>=this.min.y&&e.min.y<=this.max.y&&e.max.z>=this.min.z&&e.min.z<=this.max.z}intersectsSphere(e){return this.clampPoint(e.center,Mi),Mi.distanceToSquared(e.center)<=e.radius*e.radius}intersectsPlane(e){let t,i;return e.normal.x>0?(t=e.normal.x*this.min.x,i=e.normal.x*this.max.x):(t=e.normal.x*this.max.x,i=e.normal.x*this.min.x),e.normal.y>0?(t+=e.normal.y*this.min.y,i+=e.normal.y*this.max.y):(t+=e.normal.y*this.max.y,i+=e.normal.y*this.min.y),e.normal.z>0?(t+=e.normal.z*this.min.z,i+=e.normal.z*this.max.z):(t+=e.normal.z*this.max.z,i+=e.normal.z*this.min.z),t<=-e.constant&&i>=-e.constant}intersectsTriangle(e){if(this.isEmpty())return!1;this.getCenter(io),$o.subVectors(this.max,io),Vn.subVectors(e.a,io),kn.subVectors(e.b,io),Wn.subVectors(e.c,io),Yi.subVectors(kn,Vn),Zi.subVectors(Wn,kn),hn.subVectors(Vn,Wn);let t=[0,-Yi.z,Yi.y,0,-Zi.z,Zi.y,0,-hn.z,hn.y,Yi.z,0,-Yi.x,Zi.z,0,-Zi.x,hn.z,0,-hn.x,-Yi.y,Yi.x,0,-Zi.y,Zi.x,0,-hn.y,hn.x,0];return!Ma(t,Vn,kn,Wn,$o)||(t=[1,0,0,0,1,0,0,0,1],!Ma(t,Vn,kn,Wn,$o))?!1:(Qo.crossVectors(Yi,Zi),t=[Qo.x,Qo.y,Qo.z],Ma(t,Vn,kn,Wn,$o))}clampPoint(e,t){return t.copy(e).clamp(this.min,this.max)}distanceToPoint(e){return this.clampPoint(e,Mi).distanceTo(e)}getBoundingSphere(e){return this.isEmpty()?e.makeEmpty():(this.getCenter(e.center),e.radius=this.getSize(Mi).length()*.5),e}intersect(e){return this.min.max(e.min),this.max.min(e.max),this.isEmpty()&&this.makeEmpty(),this}union(e){return this.min.min(e.min),this.max.max(e.max),this}applyMatrix4(e){return this.isEmpty()?this:(Ui[0].set(this.min.x,this.min.y,this.min.z).applyMatrix4(e),Ui[1].set(this.min.x,this.min.y,this.max.z).applyMatrix4(e),Ui[2].set(this.min.x,this.max.y,this.min.z).applyMatrix4(e),Ui[3].set(this.min.x,this.max.y,this.max.z).applyMatrix4(e),Ui[4].set(this.max.x,this.min.y,this.min.z).applyMatrix4(e),Ui[5].set(this.max.x,this.min.y,this.max.z).applyMatrix4(e),Ui[6].set(this.max.x,this.max.y,this.min.z).applyMatrix4(e),Ui[7].set(this.max.x,this.max.y,this.max.z).applyMatrix4(e),this.setFromPoints(Ui),this)}translate(e){return this.min.add(e),this.max.add(e),this}equals(e){return e.min.equals(this.min)&&e.max.equals(this.max)}toJSON(){return{min:this.min.toArray(),max:this.max.toArray()}}fromJSON(e){return this.min.fromArray(e.min),this.max.fromArray(e.max),this}},Ui=[new I,new I,new I,new I,new I,new I,new I,new I],Mi=new I,Jo=new Jt,Vn=new I,kn=new I,Wn=new I,Yi=new I,Zi=new I,hn=new I,io=new I,$o=new I,Qo=new I,dn=new I;function Ma(n,e,t,i,r){for(let o=0,s=n.length-3;o<=s;o+=3){dn.fromArray(n,o);let a=r.x*Math.abs(dn.x)+r.y*Math.abs(dn.y)+r.z*Math.abs(dn.z),c=e.dot(dn),l=t.dot(dn),f=i.dot(dn);if(Math.max(-Math.max(c,l,f),Math.min(c,l,f))>a)return!1}return!0}var ht=new I,jo=new ye,Wd=0,$t=class extends yt{constructor(e,t,i=!1){if(super(),Array.isArray(e))throw new TypeError("THREE.BufferAttribute: array should be a Typed Array.");this.isBufferAttribute=!0,Object.defineProperty(this,"id",{value:Wd++}),this.name="",this.array=e,this.itemSize=t,this.count=e!==void 0?e.length/t:0,this.normalized=i,this.usage=Ul,this.updateRanges=[],this.gpuType=ut,this.version=0,this._normalizationScale=e!==void 0?zo(e):void 0}onUploadCallback(){}set needsUpdate(e){e===!0&&this.version++}setUsage(e){return this.usage=e,this}addUpdateRange(e,t){this.updateRanges.push({start:e,count:t})}clearUpdateRanges(){this.updateRanges.length=0}copy(e){return this.name=e.name,this.array=new e.array.constructor(e.array),this.itemSize=e.itemSize,this.count=e.count,this.normalized=e.normalized,this.usage=e.usage,this.gpuType=e.gpuType,this._normalizationScale=e._normalizationScale,this}copyAt(e,t,i){e*=this.itemSize,i*=t.itemSize;for(let r=0,o=this.itemSize;r<o;r++)this.array[e+r]=t.array[i+r];return this}copyArray(e){return this.array.set(e),this}applyMatrix3(e){if(this.itemSize===2)for(let t=0,i=this.count;t<i;t++)jo.fromBufferAttribute(this,t),jo.applyMatrix3(e),this.setXY(t,jo.x,jo.y);else if(this.itemSize===3)for(let t=0,i=this.count;t<i;t++)ht.fromBufferAttribute(this,t),ht.applyMatrix3(e),this.setXYZ(t,ht.x,ht.y,ht.z);return this}applyMatrix4(e){for(let t=0,i=this.count;t<i;t++)ht.fromBufferAttribute(this,t),ht.applyMatrix4(e),this.setXYZ(t,ht.x,ht.y,ht.z);return this}applyNormalMatrix(e){for(let t=0,i=this.count;t<i;t++)ht.fromBufferAttribute(this,t),ht.applyNormalMatrix(e),this.setXYZ(t,ht.x,ht.y,ht.z);return this}transformDirection(e){for(let t=0,i=this.count;t<i;t++)ht.fromBufferAttribute(this,t),ht.transformDirection(e),this.setXYZ(t,ht.x,ht.y,ht.z);return this}set(e,t=0){return this.array.set(e,t),this}getComponent(e,t){let i=this.array[e*this.itemSize+t];return this.normalized&&(i=this._denormalize(i)),i}setComponent(e,t,i){return this.normalized&&(i=this._normalize(i)),this.array[e*this.itemSize+t]=i,this}getX(e){let t=this.array[e*this.itemSize];return this.normalized&&(t=this._denormalize(t)),t}setX(e,t){return this.normalized&&(t=this._normalize(t)),this.array[e*this.itemSize]=t,this}getY(e){let t=this.array[e*this.itemSize+1];return this.normalized&&(t=this._denormalize(t)),t}setY(e,t){return this.normalized&&(t=this._normalize(t)),this.array[e*this.itemSize+1]=t,this}getZ(e){let t=this.array[e*this.itemSize+2];return this.normalized&&(t=this._denormalize(t)),t}setZ(e,t){return this.normalized&&(t=this._normalize(t)),this.array[e*this.itemSize+2]=t,this}getW(e){let t=this.array[e*this.itemSize+3];return this.normalized&&(t=this._denormalize(t)),t}setW(e,t){return this.normalized&&(t=this._normalize(t)),this.array[e*this.itemSize+3]=t,this}setXY(e,t,i){return e*=this.itemSize,this.normalized&&(t=this._normalize(t),i=this._normalize(i)),this.array[e+0]=t,this.array[e+1]=i,this}setXYZ(e,t,i,r){return e*=this.itemSize,this.normalized&&(t=this._normalize(t),i=this._normalize(i),r=this._normalize(r)),this.array[e+0]=t,this.array[e+1]=i,this.array[e+2]=r,this}setXYZW(e,t,i,r,o){return e*=this.itemSize,this.normalized&&(t=this._normalize(t),i=this._normalize(i),r=this._normalize(r),o=this._normalize(o)),this.array[e+0]=t,this.array[e+1]=i,this.array[e+2]=r,this.array[e+3]=o,this}onUpload(e){return this.onUploadCallback=e,this}clone(){return new this.constructor(this.array,this.itemSize).copy(this)}toJSON(){let e={itemSize:this.itemSize,type:this.array.constructor.name,array:Array.from(this.array),normalized:this.normalized};return e.name=this.name,e.usage=this.usage,e.gpuType=this.gpuType,e}dispose(){this.dispatchEvent({type:"dispose"})}_denormalize(e){let t=this._normalizationScale;return t!==void 0?Math.max(e/t,-1):oa(e,this.array)}_normalize(e){let t=this._normalizationScale;return t!==void 0?Math.round(e*t):sa(e,this.array)}};var Xn=class extends $t{constructor(e,t,i){super(new Uint16Array(e),t,i)}};var qn=class extends $t{constructor(e,t,i){super(new Uint32Array(e),t,i)}};var $e=class extends $t{constructor(e,t,i){super(new Float32Array(e),t,i)}};var Xd=new Jt,no=new I,va=new I,Ct=class{constructor(e=new I,t=-1){this.isSphere=!0,this.center=e,this.radius=t}set(e,t){return this.center.copy(e),this.radius=t,this}setFromPoints(e,t){let i=this.center;t!==void 0?i.copy(t):Xd.setFromPoints(e).getCenter(i);let r=0;for(let o=0,s=e.length;o<s;o++)r=Math.max(r,i.distanceToSquared(e[o]));return this.radius=Math.sqrt(r),this}copy(e){return this.center.copy(e.center),this.radius=e.radius,this}isEmpty(){return this.radius<0}makeEmpty(){return this.center.set(0,0,0),this.radius=-1,this}containsPoint(e){return e.distanceToSquared(this.center)<=this.radius*this.radius}distanceToPoint(e){return e.distanceTo(this.center)-this.radius}intersectsSphere(e){let t=this.radius+e.radius;return e.center.distanceToSquared(this.center)<=t*t}intersectsBox(e){return e.intersectsSphere(this)}intersectsPlane(e){return Math.abs(e.distanceToPoint(this.center))<=this.radius}clampPoint(e,t){let i=this.center.distanceToSquared(e);return t.copy(e),i>this.radius*this.radius&&(t.sub(this.center).normalize(),t.multiplyScalar(this.radius).add(this.center)),t}getBoundingBox(e){return this.isEmpty()?(e.makeEmpty(),e):(e.set(this.center,this.center),e.expandByScalar(this.radius),e)}applyMatrix4(e){return this.center.applyMatrix4(e),this.radius=this.radius*e.getMaxScaleOnAxis(),this}translate(e){return this.center.add(e),this}expandByPoint(e){if(this.isEmpty())return this.center.copy(e),this.radius=0,this;no.subVectors(e,this.center);let t=no.lengthSq();if(t>this.radius*this.radius){let i=Math.sqrt(t),r=(i-this.radius)*.5;this.center.addScaledVector(no,r/i),this.radius+=r}return this}union(e){return e.isEmpty()?this:this.isEmpty()?(this.copy(e),this):(this.center.equals(e.center)===!0?this.radius=Math.max(this.radius,e.radius):(va.subVectors(e.center,this.center).setLength(e.radius),this.expandByPoint(no.copy(e.center).add(va)),this.expandByPoint(no.copy(e.center).sub(va))),this)}equals(e){return e.center.equals(this.center)&&e.radius===this.radius}clone(){return new this.constructor().copy(this)}toJSON(){return{radius:this.radius,center:this.center.toArray()}}fromJSON(e){return this.radius=e.radius,this.center.fromArray(e.center),this}};var qd=0,ui=new we,Ea=new Xe,Yn=new I,ti=new Jt,ro=new Jt,At=new I,nt=class n extends yt{constructor(){super(),this.isBufferGeometry=!0,Object.defineProperty(this,"id",{value:qd++}),this.uuid=gi(),this.name="",this.type="BufferGeometry",this.index=null,this.indirect=null,this.indirectOffset=0,this.attributes={},this.morphAttributes={},this.morphTargetsRelative=!1,this.groups=[],this.boundingBox=null,this.boundingSphere=null,this.drawRange={start:0,count:1/0},this.userData={},this._transformed=!1}getIndex(){return this.index}setIndex(e){return Array.isArray(e)?this.index=new(Fl(e)?qn:Xn)(e,1):this.index=e,this}setIndirect(e,t=0){return this.indirect=e,this.indirectOffset=t,this}getIndirect(){return this.indirect}getAttribute(e){return this.attributes[e]}setAttribute(e,t){return this.attributes[e]=t,this}deleteAttribute(e){return delete this.attributes[e],this}hasAttribute(e){return this.attributes[e]!==void 0}addGroup(e,t,i=0){this.groups.push({start:e,count:t,materialIndex:i})}clearGroups(){this.groups=[]}setDrawRange(e,t){this.drawRange.start=e,this.drawRange.count=t}applyMatrix4(e){let t=this.attributes.position;t!==void 0&&(t.applyMatrix4(e),t.needsUpdate=!0);let i=this.attributes.normal;if(i!==void 0){let o=new Ee().getNormalMatrix(e);i.applyNormalMatrix(o),i.needsUpdate=!0}let r=this.attributes.tangent;return r!==void 0&&(r.transformDirection(e),r.needsUpdate=!0),this.boundingBox!==null&&this.computeBoundingBox(),this.boundingSphere!==null&&this.computeBoundingSphere(),this._transformed=!0,this}applyQuaternion(e){return ui.makeRotationFromQuaternion(e),this.applyMatrix4(ui),this}rotateX(e){return ui.makeRotationX(e),this.applyMatrix4(ui),this}rotateY(e){return ui.makeRotationY(e),this.applyMatrix4(ui),this}rotateZ(e){return ui.makeRotationZ(e),this.applyMatrix4(ui),this}translate(e,t,i){return ui.makeTranslation(e,t,i),this.applyMatrix4(ui),this}scale(e,t,i){return ui.makeScale(e,t,i),this.applyMatrix4(ui),this}lookAt(e){return Ea.lookAt(e),Ea.updateMatrix(),this.applyMatrix4(Ea.matrix),this}center(){return this.computeBoundingBox(),this.boundingBox.getCenter(Yn).negate(),this.translate(Yn.x,Yn.y,Yn.z),this}setFromPoints(e){let t=this.getAttribute("position");if(t===void 0){let i=[];for(let r=0,o=e.length;r<o;r++){let s=e[r];i.push(s.x,s.y,s.z||0)}this.setAttribute("position",new $e(i,3))}else{let i=Math.min(e.length,t.count);for(let r=0;r<i;r++){let o=e[r];t.setXYZ(r,o.x,o.y,o.z||0)}e.length>t.count&&pe("BufferGeometry: Buffer size too small for points data. Use .dispose() and create a new geometry."),t.needsUpdate=!0}return this}computeBoundingBox(){this.boundingBox===null&&(this.boundingBox=new Jt);let e=this.attributes.position,t=this.morphAttributes.position;if(e&&e.isGLBufferAttribute){Oe("BufferGeometry.computeBoundingBox(): GLBufferAttribute requires a manual bounding box.",this),this.boundingBox.set(new I(-1/0,-1/0,-1/0),new I(1/0,1/0,1/0));return}if(e!==void 0){if(this.boundingBox.setFromBufferAttribute(e),t)for(let i=0,r=t.length;i<r;i++){let o=t[i];ti.setFromBufferAttribute(o),this.morphTargetsRelative?(At.addVectors(this.boundingBox.min,ti.min),this.boundingBox.expandByPoint(At),At.addVectors(this.boundingBox.max,ti.max),this.boundingBox.expandByPoint(At)):(this.boundingBox.expandByPoint(ti.min),this.boundingBox.expandByPoint(ti.max))}}else this.boundingBox.makeEmpty();(isNaN(this.boundingBox.min.x)||isNaN(this.boundingBox.min.y)||isNaN(this.boundingBox.min.z))&&Oe('BufferGeometry.computeBoundingBox(): Computed min/max have NaN values. The "position" attribute is likely to have NaN values.',this)}computeBoundingSphere(){this.boundingSphere===null&&(this.boundingSphere=new Ct);let e=this.attributes.position,t=this.morphAttributes.position;if(e&&e.isGLBufferAttribute){Oe("BufferGeometry.computeBoundingSphere(): GLBufferAttribute requires a manual bounding sphere.",this),this.boundingSphere.set(new I,1/0);return}if(e){let i=this.boundingSphere.center;if(ti.setFromBufferAttribute(e),t)for(let o=0,s=t.length;o<s;o++){let a=t[o];ro.setFromBufferAttribute(a),this.morphTargetsRelative?(At.addVectors(ti.min,ro.min),ti.expandByPoint(At),At.addVectors(ti.max,ro.max),ti.expandByPoint(At)):(ti.expandByPoint(ro.min),ti.expandByPoint(ro.max))}ti.getCenter(i);let r=0;for(let o=0,s=e.count;o<s;o++)At.fromBufferAttribute(e,o),r=Math.max(r,i.distanceToSquared(At));if(t)for(let o=0,s=t.length;o<s;o++){let a=t[o],c=this.morphTargetsRelative;for(let l=0,f=a.count;l<f;l++)At.fromBufferAttribute(a,l),c&&(Yn.fromBufferAttribute(e,l),At.add(Yn)),r=Math.max(r,i.distanceToSquared(At))}this.boundingSphere.radius=Math.sqrt(r),isNaN(this.boundingSphere.radius)&&Oe('BufferGeometry.computeBoundingSphere(): Computed radius is NaN. The "position" attribute is likely to have NaN values.',this)}}computeTangents(){let e=this.index,t=this.attributes;if(e===null||t.position===void 0||t.normal===void 0||t.uv===void 0){Oe("BufferGeometry: .computeTangents() failed. Missing required attributes (index, position, normal or uv)");return}let i=t.position,r=t.normal,o=t.uv,s=this.getAttribute("tangent");(s===void 0||s.count!==i.count)&&(s=new $t(new Float32Array(4*i.count),4),this.setAttribute("tangent",s));let a=[],c=[],l=new Uint8Array(i.count);for(let B=0;B<i.count;B++)a[B]=new I,c[B]=new I;let f=new I,d=new I,h=new I,m=new ye,x=new ye,v=new ye,p=new I,u=new I;function y(B,D,U){l[B]=l[D]=l[U]=1,f.fromBufferAttribute(i,B),d.fromBufferAttribute(i,D),h.fromBufferAttribute(i,U),m.fromBufferAttribute(o,B),x.fromBufferAttribute(o,D),v.fromBufferAttribute(o,U),d.sub(f),h.sub(f),x.sub(m),v.sub(m);let z=1/(x.x*v.y-v.x*x.y);isFinite(z)&&(p.copy(d).multiplyScalar(v.y).addScaledVector(h,-x.y).multiplyScalar(z),u.copy(h).multiplyScalar(x.x).addScaledVector(d,-v.x).multiplyScalar(z),a[B].add(p),a[D].add(p),a[U].add(p),c[B].add(u),c[D].add(u),c[U].add(u))}let A=this.groups;A.length===0&&(A=[{start:0,count:e.count}]);for(let B=0,D=A.length;B<D;++B){let U=A[B],z=U.start,$=U.count;for(let P=z,W=z+$;P<W;P+=3)y(e.getX(P+0),e.getX(P+1),e.getX(P+2))}let M=new I,C=new I,b=new I,g=new I;function T(B){b.fromBufferAttribute(r,B),g.copy(b);let D=a[B];M.copy(D),M.sub(b.multiplyScalar(b.dot(D))).normalize(),C.crossVectors(g,D);let z=C.dot(c[B])<0?-1:1;s.setXYZW(B,M.x,M.y,M.z,z)}for(let B=0,D=i.count;B<D;++B)l[B]&&T(B);this._transformed=!0}computeVertexNormals(){let e=this.index,t=this.getAttribute("position");if(t!==void 0){let i=this.getAttribute("normal");if(i===void 0||i.count!==t.count)i=new $t(new Float32Array(t.count*3),3),this.setAttribute("normal",i);else for(let h=0,m=i.count;h<m;h++)i.setXYZ(h,0,0,0);let r=new I,o=new I,s=new I,a=new I,c=new I,l=new I,f=new I,d=new I;if(e)for(let h=0,m=e.count;h<m;h+=3){let x=e.getX(h+0),v=e.getX(h+1),p=e.getX(h+2);r.fromBufferAttribute(t,x),o.fromBufferAttribute(t,v),s.fromBufferAttribute(t,p),f.subVectors(s,o),d.subVectors(r,o),f.cross(d),a.fromBufferAttribute(i,x),c.fromBufferAttribute(i,v),l.fromBufferAttribute(i,p),a.add(f),c.add(f),l.add(f),i.setXYZ(x,a.x,a.y,a.z),i.setXYZ(v,c.x,c.y,c.z),i.setXYZ(p,l.x,l.y,l.z)}else for(let h=0,m=t.count;h<m;h+=3)r.fromBufferAttribute(t,h+0),o.fromBufferAttribute(t,h+1),s.fromBufferAttribute(t,h+2),f.subVectors(s,o),d.subVectors(r,o),f.cross(d),i.setXYZ(h+0,f.x,f.y,f.z),i.setXYZ(h+1,f.x,f.y,f.z),i.setXYZ(h+2,f.x,f.y,f.z);this.normalizeNormals(),i.needsUpdate=!0}}normalizeNormals(){let e=this.attributes.normal;for(let t=0,i=e.count;t<i;t++)At.fromBufferAttribute(e,t),At.normalize(),e.setXYZ(t,At.x,At.y,At.z)}toNonIndexed(){function e(a,c){let l=a.array,f=a.itemSize,d=a.normalized,h=new l.constructor(c.length*f),m=0,x=0;for(let v=0,p=c.length;v<p;v++){a.isInterleavedBufferAttribute?m=c[v]*a.data.stride+a.offset:m=c[v]*f;for(let u=0;u<f;u++)h[x++]=l[m++]}return new $t(h,f,d)}if(this.index===null)return pe("BufferGeometry.toNonIndexed(): BufferGeometry is already non-indexed."),this;let t=new n,i=this.index.array,r=this.attributes;for(let a in r){let c=r[a],l=e(c,i);t.setAttribute(a,l)}let o=this.morphAttributes;for(let a in o){let c=[],l=o[a];for(let f=0,d=l.length;f<d;f++){let h=l[f],m=e(h,i);c.push(m)}t.morphAttributes[a]=c}t.morphTargetsRelative=this.morphTargetsRelative;let s=this.groups;for(let a=0,c=s.length;a<c;a++){let l=s[a];t.addGroup(l.start,l.count,l.materialIndex)}return t}toJSON(){let e={metadata:{version:4.7,type:"BufferGeometry",generator:"BufferGeometry.toJSON"}};if(e.uuid=this.uuid,e.type=this.parameters!==void 0&&this._transformed===!0?"BufferGeometry":this.type,e.name=this.name,Object.keys(this.userData).length>0&&(e.userData=this.userData),this.parameters!==void 0&&this._transformed!==!0){let c=this.parameters;for(let l in c)c[l]!==void 0&&(e[l]=c[l]);return e}e.data={attributes:{}};let t=this.index;t!==null&&(e.data.index={type:t.array.constructor.name,array:Array.prototype.slice.call(t.array)});let i=this.attributes;for(let c in i){let l=i[c];e.data.attributes[c]=l.toJSON(e.data)}let r={},o=!1;for(let c in this.morphAttributes){let l=this.morphAttributes[c],f=[];for(let d=0,h=l.length;d<h;d++){let m=l[d];f.push(m.toJSON(e.data))}f.length>0&&(r[c]=f,o=!0)}o&&(e.data.morphAttributes=r,e.data.morphTargetsRelative=this.morphTargetsRelative);let s=this.groups;s.length>0&&(e.data.groups=JSON.parse(JSON.stringify(s)));let a=this.boundingSphere;return a!==null&&(e.data.boundingSphere=a.toJSON()),e}clone(){return new this.constructor().copy(this)}copy(e){this.index=null,this.attributes={},this.morphAttributes={},this.groups=[],this.boundingBox=null,this.boundingSphere=null;let t={};this.name=e.name;let i=e.index;i!==null&&this.setIndex(i.clone());let r=e.attributes;for(let l in r){let f=r[l];this.setAttribute(l,f.clone(t))}let o=e.morphAttributes;for(let l in o){let f=[],d=o[l];for(let h=0,m=d.length;h<m;h++)f.push(d[h].clone(t));this.morphAttributes[l]=f}this.morphTargetsRelative=e.morphTargetsRelative;let s=e.groups;for(let l=0,f=s.length;l<f;l++){let d=s[l];this.addGroup(d.start,d.count,d.materialIndex)}let a=e.boundingBox;a!==null&&(this.boundingBox=a.clone());let c=e.boundingSphere;return c!==null&&(this.boundingSphere=c.clone()),this.drawRange.start=e.drawRange.start,this.drawRange.count=e.drawRange.count,this.userData=e.userData,this._transformed=e._transformed,this}dispose(){this.dispatchEvent({type:"dispose"})}};var Ta=new I,Yd=new I,Zd=new Ee,Vt=class{constructor(e=new I(1,0,0),t=0){this.isPlane=!0,this.normal=e,this.constant=t}set(e,t){return this.normal.copy(e),this.constant=t,this}setComponents(e,t,i,r){return this.normal.set(e,t,i),this.constant=r,this}setFromNormalAndCoplanarPoint(e,t){return this.normal.copy(e),this.constant=-t.dot(this.normal),this}setFromCoplanarPoints(e,t,i){let r=Ta.subVectors(i,t).cross(Yd.subVectors(e,t)).normalize();return this.setFromNormalAndCoplanarPoint(r,e),this}copy(e){return this.normal.copy(e.normal),this.constant=e.constant,this}normalize(){let e=1/this.normal.length();return this.normal.multiplyScalar(e),this.constant*=e,this}negate(){return this.constant*=-1,this.normal.negate(),this}distanceToPoint(e){return this.normal.dot(e)+this.constant}distanceToSphere(e){return this.distanceToPoint(e.center)-e.radius}projectPoint(e,t){return t.copy(e).addScaledVector(this.normal,-this.distanceToPoint(e))}intersectLine(e,t,i=!0){let r=e.delta(Ta),o=this.normal.dot(r);if(o===0)return this.distanceToPoint(e.start)===0?t.copy(e.start):null;let s=-(e.start.dot(this.normal)+this.constant)/o;return i===!0&&(s<0||s>1)?null:t.copy(e.start).addScaledVector(r,s)}intersectsLine(e){let t=this.distanceToPoint(e.start),i=this.distanceToPoint(e.end);return t<0&&i>0||i<0&&t>0}intersectsBox(e){return e.intersectsPlane(this)}intersectsSphere(e){return e.intersectsPlane(this)}coplanarPoint(e){return e.copy(this.normal).multiplyScalar(-this.constant)}applyMatrix4(e,t){let i=t||Zd.getNormalMatrix(e),r=this.coplanarPoint(Ta).applyMatrix4(e),o=this.normal.applyMatrix3(i).normalize();return this.constant=-r.dot(o),this}translate(e){return this.constant-=e.dot(this.normal),this}equals(e){return e.normal.equals(this.normal)&&e.constant===this.constant}clone(){return new this.constructor().copy(this)}toJSON(){return{normal:this.normal.toArray(),constant:this.constant}}fromJSON(e){return this.normal.fromArray(e.normal),this.constant=e.constant,this}};var Kd=0,dt=class extends yt{constructor(){super(),this.isMaterial=!0,Object.defineProperty(this,"id",{value:Kd++}),this.uuid=gi(),this.name="",this.type="Material",this.blending=zi,this.side=li,this.vertexColors=!1,this.opacity=1,this.transparent=!1,this.alphaHash=!1,this.blendSrc=xo,this.blendDst=So,this.blendEquation=Hi,this.blendSrcAlpha=null,this.blendDstAlpha=null,this.blendEquationAlpha=null,this.blendColor=new Me(0,0,0),this.blendAlpha=0,this.depthFunc=Vi,this.depthTest=!0,this.depthWrite=!0,this.stencilWriteMask=255,this.stencilFunc=wl,this.stencilRef=0,this.stencilFuncMask=255,this.stencilFail=No,this.stencilZFail=No,this.stencilZPass=No,this.stencilWrite=!1,this.clippingPlanes=null,this.clipIntersection=!1,this.clipShadows=!1,this.shadowSide=null,this.colorWrite=!0,this.precision=null,this.polygonOffset=!1,this.polygonOffsetFactor=0,this.polygonOffsetUnits=0,this.dithering=!1,this.alphaToCoverage=!1,this.premultipliedAlpha=!1,this.forceSinglePass=!1,this.allowOverride=!0,this.visible=!0,this.toneMapped=!0,this.userData={},this.version=0,this._alphaTest=0}get alphaTest(){return this._alphaTest}set alphaTest(e){this._alphaTest>0!=e>0&&this.version++,this._alphaTest=e}onBeforeRender(){}onBeforeCompile(){}customProgramCacheKey(){return this.onBeforeCompile.toString()}setValues(e){if(e!==void 0)for(let t in e){let i=e[t];if(i===void 0){pe(`Material: parameter '${t}' has value of undefined.`);continue}let r=this[t];if(r===void 0){pe(`Material: '${t}' is not a property of THREE.${this.type}.`);continue}r&&r.isColor?r.set(i):r&&r.isVector2&&i&&i.isVector2||r&&r.isEuler&&i&&i.isEuler||r&&r.isVector3&&i&&i.isVector3?r.copy(i):this[t]=i}}toJSON(e){let t=e===void 0||typeof e=="string";t&&(e={textures:{},images:{}});let i={metadata:{version:4.7,type:"Material",generator:"Material.toJSON"}};i.uuid=this.uuid,i.type=this.type,i.blending=this.blending,i.side=this.side,i.shadowSide=this.shadowSide,i.vertexColors=this.vertexColors,i.opacity=this.opacity,i.transparent=this.transparent,i.blendSrc=this.blendSrc,i.blendDst=this.blendDst,i.blendEquation=this.blendEquation,i.blendSrcAlpha=this.blendSrcAlpha,i.blendDstAlpha=this.blendDstAlpha,i.blendEquationAlpha=this.blendEquationAlpha,i.blendColor=this.blendColor.getHex(),i.blendAlpha=this.blendAlpha,i.depthFunc=this.depthFunc,i.depthTest=this.depthTest,i.depthWrite=this.depthWrite,i.colorWrite=this.colorWrite,i.clipIntersection=this.clipIntersection,i.clipShadows=this.clipShadows,i.stencilWriteMask=this.stencilWriteMask,i.stencilFunc=this.stencilFunc,i.stencilRef=this.stencilRef,i.stencilFuncMask=this.stencilFuncMask,i.stencilFail=this.stencilFail,i.stencilZFail=this.stencilZFail,i.stencilZPass=this.stencilZPass,i.stencilWrite=this.stencilWrite,i.polygonOffset=this.polygonOffset,i.polygonOffsetFactor=this.polygonOffsetFactor,i.polygonOffsetUnits=this.polygonOffsetUnits,i.dithering=this.dithering,i.alphaTest=this.alphaTest,i.alphaHash=this.alphaHash,i.alphaToCoverage=this.alphaToCoverage,i.premultipliedAlpha=this.premultipliedAlpha,i.forceSinglePass=this.forceSinglePass,i.allowOverride=this.allowOverride,i.visible=this.visible,i.toneMapped=this.toneMapped,i.name=this.name,this.color&&this.color.isColor&&(i.color=this.color.getHex()),this.roughness!==void 0&&(i.roughness=this.roughness),this.metalness!==void 0&&(i.metalness=this.metalness),this.sheen!==void 0&&(i.sheen=this.sheen),this.sheenColor&&this.sheenColor.isColor&&(i.sheenColor=this.sheenColor.getHex()),this.sheenRoughness!==void 0&&(i.sheenRoughness=this.sheenRoughness),this.emissive&&this.emissive.isColor&&(i.emissive=this.emissive.getHex()),this.emissiveIntensity!==void 0&&(i.emissiveIntensity=this.emissiveIntensity),this.specular&&this.specular.isColor&&(i.specular=this.specular.getHex()),this.specularIntensity!==void 0&&(i.specularIntensity=this.specularIntensity),this.specularColor&&this.specularColor.isColor&&(i.specularColor=this.specularColor.getHex()),this.shininess!==void 0&&(i.shininess=this.shininess),this.clearcoat!==void 0&&(i.clearcoat=this.clearcoat),this.clearcoatRoughness!==void 0&&(i.clearcoatRoughness=this.clearcoatRoughness),this.diffuseRoughness!==void 0&&(i.diffuseRoughness=this.diffuseRoughness),this.diffuseRoughnessMap&&this.diffuseRoughnessMap.isTexture&&(i.diffuseRoughnessMap=this.diffuseRoughnessMap.toJSON(e).uuid),this.clearcoatMap&&this.clearcoatMap.isTexture&&(i.clearcoatMap=this.clearcoatMap.toJSON(e).uuid),this.clearcoatRoughnessMap&&this.clearcoatRoughnessMap.isTexture&&(i.clearcoatRoughnessMap=this.clearcoatRoughnessMap.toJSON(e).uuid),this.clearcoatNormalMap&&this.clearcoatNormalMap.isTexture&&(i.clearcoatNormalMap=this.clearcoatNormalMap.toJSON(e).uuid,i.clearcoatNormalScale=this.clearcoatNormalScale.toArray()),this.sheenColorMap&&this.sheenColorMap.isTexture&&(i.sheenColorMap=this.sheenColorMap.toJSON(e).uuid),this.sheenRoughnessMap&&this.sheenRoughnessMap.isTexture&&(i.sheenRoughnessMap=this.sheenRoughnessMap.toJSON(e).uuid),this.dispersion!==void 0&&(i.dispersion=this.dispersion),this.retroreflectivity!==void 0&&(i.retroreflectivity=this.retroreflectivity),this.iridescence!==void 0&&(i.iridescence=this.iridescence),this.iridescenceIOR!==void 0&&(i.iridescenceIOR=this.iridescenceIOR),this.iridescenceThicknessMinimum!==void 0&&(i.iridescenceThicknessMinimum=this.iridescenceThicknessMinimum),this.iridescenceThicknessMaximum!==void 0&&(i.iridescenceThicknessMaximum=this.iridescenceThicknessMaximum),this.iridescenceMap&&this.iridescenceMap.isTexture&&(i.iridescenceMap=this.iridescenceMap.toJSON(e).uuid),this.iridescenceThicknessMap&&this.iridescenceThicknessMap.isTexture&&(i.iridescenceThicknessMap=this.iridescenceThicknessMap.toJSON(e).uuid),this.anisotropy!==void 0&&(i.anisotropy=this.anisotropy),this.anisotropyRotation!==void 0&&(i.anisotropyRotation=this.anisotropyRotation),this.anisotropyMap&&this.anisotropyMap.isTexture&&(i.anisotropyMap=this.anisotropyMap.toJSON(e).uuid),this.map&&this.map.isTexture&&(i.map=this.map.toJSON(e).uuid),this.matcap&&this.matcap.isTexture&&(i.matcap=this.matcap.toJSON(e).uuid),this.alphaMap&&this.alphaMap.isTexture&&(i.alphaMap=this.alphaMap.toJSON(e).uuid),this.lightMap&&this.lightMap.isTexture&&(i.lightMap=this.lightMap.toJSON(e).uuid,i.lightMapIntensity=this.lightMapIntensity),this.aoMap&&this.aoMap.isTexture&&(i.aoMap=this.aoMap.toJSON(e).uuid,i.aoMapIntensity=this.aoMapIntensity),this.bumpMap&&this.bumpMap.isTexture&&(i.bumpMap=this.bumpMap.toJSON(e).uuid,i.bumpScale=this.bumpScale),this.normalMap&&this.normalMap.isTexture&&(i.normalMap=this.normalMap.toJSON(e).uuid,i.normalMapType=this.normalMapType,i.normalScale=this.normalScale.toArray()),this.displacementMap&&this.displacementMap.isTexture&&(i.displacementMap=this.displacementMap.toJSON(e).uuid,i.displacementScale=this.displacementScale,i.displacementBias=this.displacementBias),this.roughnessMap&&this.roughnessMap.isTexture&&(i.roughnessMap=this.roughnessMap.toJSON(e).uuid),this.metalnessMap&&this.metalnessMap.isTexture&&(i.metalnessMap=this.metalnessMap.toJSON(e).uuid),this.emissiveMap&&this.emissiveMap.isTexture&&(i.emissiveMap=this.emissiveMap.toJSON(e).uuid),this.specularMap&&this.specularMap.isTexture&&(i.specularMap=this.specularMap.toJSON(e).uuid),this.specularIntensityMap&&this.specularIntensityMap.isTexture&&(i.specularIntensityMap=this.specularIntensityMap.toJSON(e).uuid),this.specularColorMap&&this.specularColorMap.isTexture&&(i.specularColorMap=this.specularColorMap.toJSON(e).uuid),this.envMap&&this.envMap.isTexture&&(i.envMap=this.envMap.toJSON(e).uuid,this.combine!==void 0&&(i.combine=this.combine)),this.envMapRotation!==void 0&&(i.envMapRotation=this.envMapRotation.toArray()),this.envMapIntensity!==void 0&&(i.envMapIntensity=this.envMapIntensity),this.reflectivity!==void 0&&(i.reflectivity=this.reflectivity),this.refractionRatio!==void 0&&(i.refractionRatio=this.refractionRatio),this.gradientMap&&this.gradientMap.isTexture&&(i.gradientMap=this.gradientMap.toJSON(e).uuid),this.transmission!==void 0&&(i.transmission=this.transmission),this.transmissionMap&&this.transmissionMap.isTexture&&(i.transmissionMap=this.transmissionMap.toJSON(e).uuid),this.thickness!==void 0&&(i.thickness=this.thickness),this.thicknessMap&&this.thicknessMap.isTexture&&(i.thicknessMap=this.thicknessMap.toJSON(e).uuid),this.attenuationDistance!==void 0&&(i.attenuationDistance=this.attenuationDistance),this.attenuationColor!==void 0&&(i.attenuationColor=this.attenuationColor.getHex()),this.size!==void 0&&(i.size=this.size),this.sizeAttenuation!==void 0&&(i.sizeAttenuation=this.sizeAttenuation),Array.isArray(this.clippingPlanes)&&this.clippingPlanes.length>0&&(i.clippingPlanes=this.clippingPlanes.map(o=>o.toJSON())),this.rotation!==void 0&&(i.rotation=this.rotation),this.depthPacking!==void 0&&(i.depthPacking=this.depthPacking),this.linewidth!==void 0&&(i.linewidth=this.linewidth),this.linecap!==void 0&&(i.linecap=this.linecap),this.linejoin!==void 0&&(i.linejoin=this.linejoin),this.dashSize!==void 0&&(i.dashSize=this.dashSize),this.gapSize!==void 0&&(i.gapSize=this.gapSize),this.scale!==void 0&&(i.scale=this.scale),this.wireframe!==void 0&&(i.wireframe=this.wireframe),this.wireframeLinewidth!==void 0&&(i.wireframeLinewidth=this.wireframeLinewidth),this.wireframeLinecap!==void 0&&(i.wireframeLinecap=this.wireframeLinecap),this.wireframeLinejoin!==void 0&&(i.wireframeLinejoin=this.wireframeLinejoin),this.flatShading!==void 0&&(i.flatShading=this.flatShading),this.fog!==void 0&&(i.fog=this.fog),Object.keys(this.userData).length>0&&(i.userData=this.userData);function r(o){let s=[];for(let a in o){let c=o[a];delete c.metadata,s.push(c)}return s}if(t){let o=r(e.textures),s=r(e.images);o.length>0&&(i.textures=o),s.length>0&&(i.images=s)}return i}fromJSON(e,t){if(e.uuid!==void 0&&(this.uuid=e.uuid),e.name!==void 0&&(this.name=e.name),e.color!==void 0&&this.color!==void 0&&this.color.setHex(e.color),e.roughness!==void 0&&(this.roughness=e.roughness),e.metalness!==void 0&&(this.metalness=e.metalness),e.sheen!==void 0&&(this.sheen=e.sheen),e.sheenColor!==void 0&&(this.sheenColor=new Me().setHex(e.sheenColor)),e.sheenRoughness!==void 0&&(this.sheenRoughness=e.sheenRoughness),e.emissive!==void 0&&this.emissive!==void 0&&this.emissive.setHex(e.emissive),e.specular!==void 0&&this.specular!==void 0&&this.specular.setHex(e.specular),e.specularIntensity!==void 0&&(this.specularIntensity=e.specularIntensity),e.specularColor!==void 0&&this.specularColor!==void 0&&this.specularColor.setHex(e.specularColor),e.shininess!==void 0&&(this.shininess=e.shininess),e.clearcoat!==void 0&&(this.clearcoat=e.clearcoat),e.clearcoatRoughness!==void 0&&(this.clearcoatRoughness=e.clearcoatRoughness),e.diffuseRoughness!==void 0&&(this.diffuseRoughness=e.diffuseRoughness),e.dispersion!==void 0&&(this.dispersion=e.dispersion),e.retroreflectivity!==void 0&&(this.retroreflectivity=e.retroreflectivity),e.iridescence!==void 0&&(this.iridescence=e.iridescence),e.iridescenceIOR!==void 0&&(this.iridescenceIOR=e.iridescenceIOR),e.iridescenceThicknessMinimum!==void 0&&(this.iridescenceThicknessMinimum=e.iridescenceThicknessMinimum),e.iridescenceThicknessMaximum!==void 0&&(this.iridescenceThicknessMaximum=e.iridescenceThicknessMaximum),e.iridescenceThicknessRange!==void 0&&(this.iridescenceThicknessMinimum=e.iridescenceThicknessRange[0],this.iridescenceThicknessMaximum=e.iridescenceThicknessRange[1]),e.transmission!==void 0&&(this.transmission=e.transmission),e.thickness!==void 0&&(this.thickness=e.thickness),e.attenuationDistance!==void 0&&(this.attenuationDistance=e.attenuationDistance),e.attenuationColor!==void 0&&this.attenuationColor!==void 0&&this.attenuationColor.setHex(e.attenuationColor),e.anisotropy!==void 0&&(this.anisotropy=e.anisotropy),e.anisotropyRotation!==void 0&&(this.anisotropyRotation=e.anisotropyRotation),e.fog!==void 0&&(this.fog=e.fog),e.flatShading!==void 0&&(this.flatShading=e.flatShading),e.blending!==void 0&&(this.blending=e.blending),e.combine!==void 0&&(this.combine=e.combine),e.side!==void 0&&(this.side=e.side),e.shadowSide!==void 0&&(this.shadowSide=e.shadowSide),e.opacity!==void 0&&(this.opacity=e.opacity),e.transparent!==void 0&&(this.transparent=e.transparent),e.alphaTest!==void 0&&(this.alphaTest=e.alphaTest),e.alphaHash!==void 0&&(this.alphaHash=e.alphaHash),e.depthFunc!==void 0&&(this.depthFunc=e.depthFunc),e.depthTest!==void 0&&(this.depthTest=e.depthTest),e.depthWrite!==void 0&&(this.depthWrite=e.depthWrite),e.colorWrite!==void 0&&(this.colorWrite=e.colorWrite),e.clippingPlanes!==void 0&&(this.clippingPlanes=e.clippingPlanes.map(i=>new Vt().fromJSON(i))),e.clipIntersection!==void 0&&(this.clipIntersection=e.clipIntersection),e.clipShadows!==void 0&&(this.clipShadows=e.clipShadows),e.depthPacking!==void 0&&(this.depthPacking=e.depthPacking),e.blendSrc!==void 0&&(this.blendSrc=e.blendSrc),e.blendDst!==void 0&&(this.blendDst=e.blendDst),e.blendEquation!==void 0&&(this.blendEquation=e.blendEquation),e.blendSrcAlpha!==void 0&&(this.blendSrcAlpha=e.blendSrcAlpha),e.blendDstAlpha!==void 0&&(this.blendDstAlpha=e.blendDstAlpha),e.blendEquationAlpha!==void 0&&(this.blendEquationAlpha=e.blendEquationAlpha),e.blendColor!==void 0&&this.blendColor!==void 0&&this.blendColor.setHex(e.blendColor),e.blendAlpha!==void 0&&(this.blendAlpha=e.blendAlpha),e.stencilWriteMask!==void 0&&(this.stencilWriteMask=e.stencilWriteMask),e.stencilFunc!==void 0&&(this.stencilFunc=e.stencilFunc),e.stencilRef!==void 0&&(this.stencilRef=e.stencilRef),e.stencilFuncMask!==void 0&&(this.stencilFuncMask=e.stencilFuncMask),e.stencilFail!==void 0&&(this.stencilFail=e.stencilFail),e.stencilZFail!==void 0&&(this.stencilZFail=e.stencilZFail),e.stencilZPass!==void 0&&(this.stencilZPass=e.stencilZPass),e.stencilWrite!==void 0&&(this.stencilWrite=e.stencilWrite),e.wireframe!==void 0&&(this.wireframe=e.wireframe),e.wireframeLinewidth!==void 0&&(this.wireframeLinewidth=e.wireframeLinewidth),e.wireframeLinecap!==void 0&&(this.wireframeLinecap=e.wireframeLinecap),e.wireframeLinejoin!==void 0&&(this.wireframeLinejoin=e.wireframeLinejoin),e.rotation!==void 0&&(this.rotation=e.rotation),e.linewidth!==void 0&&(this.linewidth=e.linewidth),e.linecap!==void 0&&(this.linecap=e.linecap),e.linejoin!==void 0&&(this.linejoin=e.linejoin),e.dashSize!==void 0&&(this.dashSize=e.dashSize),e.gapSize!==void 0&&(this.gapSize=e.gapSize),e.scale!==void 0&&(this.scale=e.scale),e.polygonOffset!==void 0&&(this.polygonOffset=e.polygonOffset),e.polygonOffsetFactor!==void 0&&(this.polygonOffsetFactor=e.polygonOffsetFactor),e.polygonOffsetUnits!==void 0&&(this.polygonOffsetUnits=e.polygonOffsetUnits),e.dithering!==void 0&&(this.dithering=e.dithering),e.alphaToCoverage!==void 0&&(this.alphaToCoverage=e.alphaToCoverage),e.premultipliedAlpha!==void 0&&(this.premultipliedAlpha=e.premultipliedAlpha),e.forceSinglePass!==void 0&&(this.forceSinglePass=e.forceSinglePass),e.allowOverride!==void 0&&(this.allowOverride=e.allowOverride),e.visible!==void 0&&(this.visible=e.visible),e.toneMapped!==void 0&&(this.toneMapped=e.toneMapped),e.userData!==void 0&&(this.userData=e.userData),e.vertexColors!==void 0&&(typeof e.vertexColors=="number"?this.vertexColors=e.vertexColors>0:this.vertexColors=e.vertexColors),e.size!==void 0&&(this.size=e.size),e.sizeAttenuation!==void 0&&(this.sizeAttenuation=e.sizeAttenuation),e.map!==void 0&&(this.map=t[e.map]||null),e.matcap!==void 0&&(this.matcap=t[e.matcap]||null),e.alphaMap!==void 0&&(this.alphaMap=t[e.alphaMap]||null),e.bumpMap!==void 0&&(this.bumpMap=t[e.bumpMap]||null),e.bumpScale!==void 0&&(this.bumpScale=e.bumpScale),e.normalMap!==void 0&&(this.normalMap=t[e.normalMap]||null),e.normalMapType!==void 0&&(this.normalMapType=e.normalMapType),e.normalScale!==void 0){let i=e.normalScale;Array.isArray(i)===!1&&(i=[i,i]),this.normalScale=new ye().fromArray(i)}return e.displacementMap!==void 0&&(this.displacementMap=t[e.displacementMap]||null),e.displacementScale!==void 0&&(this.displacementScale=e.displacementScale),e.displacementBias!==void 0&&(this.displacementBias=e.displacementBias),e.roughnessMap!==void 0&&(this.roughnessMap=t[e.roughnessMap]||null),e.metalnessMap!==void 0&&(this.metalnessMap=t[e.metalnessMap]||null),e.emissiveMap!==void 0&&(this.emissiveMap=t[e.emissiveMap]||null),e.emissiveIntensity!==void 0&&(this.emissiveIntensity=e.emissiveIntensity),e.specularMap!==void 0&&(this.specularMap=t[e.specularMap]||null),e.specularIntensityMap!==void 0&&(this.specularIntensityMap=t[e.specularIntensityMap]||null),e.specularColorMap!==void 0&&(this.specularColorMap=t[e.specularColorMap]||null),e.envMap!==void 0&&(this.envMap=t[e.envMap]||null),e.envMapRotation!==void 0&&this.envMapRotation.fromArray(e.envMapRotation),e.envMapIntensity!==void 0&&(this.envMapIntensity=e.envMapIntensity),e.reflectivity!==void 0&&(this.reflectivity=e.reflectivity),e.refractionRatio!==void 0&&(this.refractionRatio=e.refractionRatio),e.lightMap!==void 0&&(this.lightMap=t[e.lightMap]||null),e.lightMapIntensity!==void 0&&(this.lightMapIntensity=e.lightMapIntensity),e.aoMap!==void 0&&(this.aoMap=t[e.aoMap]||null),e.aoMapIntensity!==void 0&&(this.aoMapIntensity=e.aoMapIntensity),e.gradientMap!==void 0&&(this.gradientMap=t[e.gradientMap]||null),e.clearcoatMap!==void 0&&(this.clearcoatMap=t[e.clearcoatMap]||null),e.clearcoatRoughnessMap!==void 0&&(this.clearcoatRoughnessMap=t[e.clearcoatRoughnessMap]||null),e.clearcoatNormalMap!==void 0&&(this.clearcoatNormalMap=t[e.clearcoatNormalMap]||null),e.clearcoatNormalScale!==void 0&&(this.clearcoatNormalScale=new ye().fromArray(e.clearcoatNormalScale)),e.diffuseRoughnessMap!==void 0&&(this.diffuseRoughnessMap=t[e.diffuseRoughnessMap]||null),e.iridescenceMap!==void 0&&(this.iridescenceMap=t[e.iridescenceMap]||null),e.iridescenceThicknessMap!==void 0&&(this.iridescenceThicknessMap=t[e.iridescenceThicknessMap]||null),e.transmissionMap!==void 0&&(this.transmissionMap=t[e.transmissionMap]||null),e.thicknessMap!==void 0&&(this.thicknessMap=t[e.thicknessMap]||null),e.anisotropyMap!==void 0&&(this.anisotropyMap=t[e.anisotropyMap]||null),e.sheenColorMap!==void 0&&(this.sheenColorMap=t[e.sheenColorMap]||null),e.sheenRoughnessMap!==void 0&&(this.sheenRoughnessMap=t[e.sheenRoughnessMap]||null),this}clone(){return new this.constructor().copy(this)}copy(e){this.name=e.name,this.blending=e.blending,this.side=e.side,this.vertexColors=e.vertexColors,this.opacity=e.opacity,this.transparent=e.transparent,this.blendSrc=e.blendSrc,this.blendDst=e.blendDst,this.blendEquation=e.blendEquation,this.blendSrcAlpha=e.blendSrcAlpha,this.blendDstAlpha=e.blendDstAlpha,this.blendEquationAlpha=e.blendEquationAlpha,this.blendColor.copy(e.blendColor),this.blendAlpha=e.blendAlpha,this.depthFunc=e.depthFunc,this.depthTest=e.depthTest,this.depthWrite=e.depthWrite,this.stencilWriteMask=e.stencilWriteMask,this.stencilFunc=e.stencilFunc,this.stencilRef=e.stencilRef,this.stencilFuncMask=e.stencilFuncMask,this.stencilFail=e.stencilFail,this.stencilZFail=e.stencilZFail,this.stencilZPass=e.stencilZPass,this.stencilWrite=e.stencilWrite;let t=e.clippingPlanes,i=null;if(t!==null){let r=t.length;i=new Array(r);for(let o=0;o!==r;++o)i[o]=t[o].clone()}return this.clippingPlanes=i,this.clipIntersection=e.clipIntersection,this.clipShadows=e.clipShadows,this.shadowSide=e.shadowSide,this.colorWrite=e.colorWrite,this.precision=e.precision,this.polygonOffset=e.polygonOffset,this.polygonOffsetFactor=e.polygonOffsetFactor,this.polygonOffsetUnits=e.polygonOffsetUnits,this.dithering=e.dithering,this.alphaTest=e.alphaTest,this.alphaHash=e.alphaHash,this.alphaToCoverage=e.alphaToCoverage,this.premultipliedAlpha=e.premultipliedAlpha,this.forceSinglePass=e.forceSinglePass,this.allowOverride=e.allowOverride,this.visible=e.visible,this.toneMapped=e.toneMapped,this.userData=JSON.parse(JSON.stringify(e.userData)),this}dispose(){this.dispatchEvent({type:"dispose"})}set needsUpdate(e){e===!0&&this.version++}};var Ni=new I,ya=new I,es=new I,ts=new I,yi=class{constructor(e=new I,t=new I(0,0,-1)){this.origin=e,this.direction=t}set(e,t){return this.origin.copy(e),this.direction.copy(t),this}copy(e){return this.origin.copy(e.origin),this.direction.copy(e.direction),this}at(e,t){return t.copy(this.origin).addScaledVector(this.direction,e)}lookAt(e){return this.direction.copy(e).sub(this.origin).normalize(),this}recast(e){return this.origin.copy(this.at(e,Ni)),this}closestPointToPoint(e,t){t.subVectors(e,this.origin);let i=t.dot(this.direction);return i<0?t.copy(this.origin):t.copy(this.origin).addScaledVector(this.direction,i)}distanceToPoint(e){return Math.sqrt(this.distanceSqToPoint(e))}distanceSqToPoint(e){let t=Ni.subVectors(e,this.origin).dot(this.direction);return t<0?this.origin.distanceToSquared(e):(Ni.copy(this.origin).addScaledVector(this.direction,t),Ni.distanceToSquared(e))}distanceSqToSegment(e,t,i,r){ya.copy(e).add(t).multiplyScalar(.5),es.copy(t).sub(e).normalize(),ts.copy(this.origin).sub(ya);let o=e.distanceTo(t)*.5,s=-this.direction.dot(es),a=ts.dot(this.direction),c=-ts.dot(es),l=ts.lengthSq(),f=Math.abs(1-s*s),d,h,m,x;if(f>0)if(d=s*c-a,h=s*a-c,x=o*f,d>=0)if(h>=-x)if(h<=x){let v=1/f;d*=v,h*=v,m=d*(d+s*h+2*a)+h*(s*d+h+2*c)+l}else h=o,d=Math.max(0,-(s*h+a)),m=-d*d+h*(h+2*c)+l;else h=-o,d=Math.max(0,-(s*h+a)),m=-d*d+h*(h+2*c)+l;else h<=-x?(d=Math.max(0,-(-s*o+a)),h=d>0?-o:Math.min(Math.max(-o,-c),o),m=-d*d+h*(h+2*c)+l):h<=x?(d=0,h=Math.min(Math.max(-o,-c),o),m=h*(h+2*c)+l):(d=Math.max(0,-(s*o+a)),h=d>0?o:Math.min(Math.max(-o,-c),o),m=-d*d+h*(h+2*c)+l);else h=s>0?-o:o,d=Math.max(0,-(s*h+a)),m=-d*d+h*(h+2*c)+l;return i&&i.copy(this.origin).addScaledVector(this.direction,d),r&&r.copy(ya).addScaledVector(es,h),m}intersectSphere(e,t){if(e.radius<0)return null;Ni.subVectors(e.center,this.origin);let i=Ni.dot(this.direction),r=Ni.dot(Ni)-i*i,o=e.radius*e.radius;if(r>o)return null;let s=Math.sqrt(o-r),a=i-s,c=i+s;return c<0?null:a<0?this.at(c,t):this.at(a,t)}intersectsSphere(e){return e.radius<0?!1:this.distanceSqToPoint(e.center)<=e.radius*e.radius}distanceToPlane(e){let t=e.normal.dot(this.direction);if(t===0)return e.distanceToPoint(this.origin)===0?0:null;let i=-(this.origin.dot(e.normal)+e.constant)/t;return i>=0?i:null}intersectPlane(e,t){let i=this.distanceToPlane(e);return i===null?null:this.at(i,t)}intersectsPlane(e){let t=e.distanceToPoint(this.origin);return t===0||e.normal.dot(this.direction)*t<0}intersectBox(e,t){let i,r,o,s,a,c,l=1/this.direction.x,f=1/this.direction.y,d=1/this.direction.z,h=this.origin;return l>=0?(i=(e.min.x-h.x)*l,r=(e.max.x-h.x)*l):(i=(e.max.x-h.x)*l,r=(e.min.x-h.x)*l),f>=0?(o=(e.min.y-h.y)*f,s=(e.max.y-h.y)*f):(o=(e.max.y-h.y)*f,s=(e.min.y-h.y)*f),i>s||o>r||((o>i||isNaN(i))&&(i=o),(s<r||isNaN(r))&&(r=s),d>=0?(a=(e.min.z-h.z)*d,c=(e.max.z-h.z)*d):(a=(e.max.z-h.z)*d,c=(e.min.z-h.z)*d),i>c||a>r)||((a>i||i!==i)&&(i=a),(c<r||r!==r)&&(r=c),r<0)?null:this.at(i>=0?i:r,t)}intersectsBox(e){return this.intersectBox(e,Ni)!==null}intersectTriangle(e,t,i,r,o){let s=this.origin,a=this.direction,c=a.x,l=a.y,f=a.z,d=e.x-s.x,h=e.y-s.y,m=e.z-s.z,x=t.x-s.x,v=t.y-s.y,p=t.z-s.z,u=i.x-s.x,y=i.y-s.y,A=i.z-s.z,M=Math.abs(c),C=Math.abs(l),b=Math.abs(f),g,T,B,D,U,z,$,P,W,K,H,te;if(M>=C&&M>=b?(B=c,z=d,W=x,te=u,c>=0?(g=l,T=f,D=h,U=m,$=v,P=p,K=y,H=A):(g=f,T=l,D=m,U=h,$=p,P=v,K=A,H=y)):C>=b?(B=l,z=h,W=v,te=y,l>=0?(g=f,T=c,D=m,U=d,$=p,P=x,K=A,H=u):(g=c,T=f,D=d,U=m,$=x,P=p,K=u,H=A)):(B=f,z=m,W=p,te=A,f>=0?(g=c,T=l,D=d,U=h,$=x,P=v,K=u,H=y):(g=l,T=c,D=h,U=d,$=v,P=x,K=y,H=u)),B===0)return null;let k=g/B,J=T/B,Q=1/B,Se=D-k*z,Ne=U-J*z,Fe=$-k*W,Qe=P-J*W,Ye=K-k*te,Ze=H-J*te,Te=Ye*Qe-Ze*Fe,Ke=Se*Ze-Ne*Ye,pt=Fe*Ne-Qe*Se;if(r){if(Te<0||Ke<0||pt<0)return null}else if((Te<0||Ke<0||pt<0)&&(Te>0||Ke>0||pt>0))return null;let Ve=Te+Ke+pt;if(Ve===0)return null;let mt=Q*(Te*z+Ke*W+pt*te);return(Ve>0?mt<0:mt>0)?null:this.at(mt/Ve,o)}applyMatrix4(e){return this.origin.applyMatrix4(e),this.direction.transformDirection(e),this}equals(e){return e.origin.equals(this.origin)&&e.direction.equals(this.direction)}clone(){return new this.constructor().copy(this)}};var Zn=class extends dt{constructor(e){super(),this.isMeshBasicMaterial=!0,this.type="MeshBasicMaterial",this.color=new Me(16777215),this.map=null,this.lightMap=null,this.lightMapIntensity=1,this.aoMap=null,this.aoMapIntensity=1,this.specularMap=null,this.alphaMap=null,this.envMap=null,this.envMapRotation=new Kt,this.combine=xn,this.reflectivity=1,this.refractionRatio=.98,this.wireframe=!1,this.wireframeLinewidth=1,this.wireframeLinecap="round",this.wireframeLinejoin="round",this.fog=!0,this.setValues(e)}copy(e){return super.copy(e),this.color.copy(e.color),this.map=e.map,this.lightMap=e.lightMap,this.lightMapIntensity=e.lightMapIntensity,this.aoMap=e.aoMap,this.aoMapIntensity=e.aoMapIntensity,this.specularMap=e.specularMap,this.alphaMap=e.alphaMap,this.envMap=e.envMap,this.envMapRotation.copy(e.envMapRotation),this.combine=e.combine,this.reflectivity=e.reflectivity,this.refractionRatio=e.refractionRatio,this.wireframe=e.wireframe,this.wireframeLinewidth=e.wireframeLinewidth,this.wireframeLinecap=e.wireframeLinecap,this.wireframeLinejoin=e.wireframeLinejoin,this.fog=e.fog,this}};var tc=new we,pn=new yi,is=new Ct,ic=new I,ns=new I,rs=new I,os=new I,Aa=new I,ss=new I,nc=new I,as=new I,Ot=class extends Xe{constructor(e=new nt,t=new Zn){super(),this.isMesh=!0,this.type="Mesh",this.geometry=e,this.material=t,this.morphTargetDictionary=void 0,this.morphTargetInfluences=void 0,this.count=1,this.updateMorphTargets()}copy(e,t){return super.copy(e,t),e.morphTargetInfluences!==void 0?this.morphTargetInfluences=e.morphTargetInfluences.slice():this.morphTargetInfluences=void 0,e.morphTargetDictionary!==void 0?this.morphTargetDictionary=Object.assign({},e.morphTargetDictionary):this.morphTargetDictionary=void 0,this.material=Array.isArray(e.material)?e.material.slice():e.material,this.geometry=e.geometry,this}updateMorphTargets(){let t=this.geometry.morphAttributes,i=Object.keys(t);if(i.length>0){let r=t[i[0]];if(r!==void 0){this.morphTargetInfluences=[],this.morphTargetDictionary={};for(let o=0,s=r.length;o<s;o++){let a=r[o].name||String(o);this.morphTargetInfluences.push(0),this.morphTargetDictionary[a]=o}}}}getVertexPosition(e,t){let i=this.geometry,r=i.attributes.position,o=i.morphAttributes.position,s=i.morphTargetsRelative;t.fromBufferAttribute(r,e);let a=this.morphTargetInfluences;if(o&&a){ss.set(0,0,0);for(let c=0,l=o.length;c<l;c++){let f=a[c],d=o[c];f!==0&&(Aa.fromBufferAttribute(d,e),s?ss.addScaledVector(Aa,f):ss.addScaledVector(Aa.sub(t),f))}t.add(ss)}return t}intersectsFrustum(e){return e.intersectsObject(this)}raycast(e,t){let i=this.geometry,r=this.material,o=this.matrixWorld;r!==void 0&&(i.boundingSphere===null&&i.computeBoundingSphere(),is.copy(i.boundingSphere),is.applyMatrix4(o),pn.copy(e.ray).recast(e.near),!(is.containsPoint(pn.origin)===!1&&(pn.intersectSphere(is,ic)===null||pn.origin.distanceToSquared(ic)>(e.far-e.near)**2))&&(tc.copy(o).invert(),pn.copy(e.ray).applyMatrix4(tc),!(i.boundingBox!==null&&pn.intersectsBox(i.boundingBox)===!1)&&this._computeIntersections(e,t,pn)))}_computeIntersections(e,t,i){let r,o=this.geometry,s=this.material,a=o.index,c=o.attributes.position,l=o.attributes.uv,f=o.attributes.uv1,d=o.attributes.normal,h=o.groups,m=o.drawRange;if(a!==null)if(Array.isArray(s))for(let x=0,v=h.length;x<v;x++){let p=h[x],u=s[p.materialIndex],y=Math.max(p.start,m.start),A=Math.min(a.count,Math.min(p.start+p.count,m.start+m.count));for(let M=y,C=A;M<C;M+=3){let b=a.getX(M),g=a.getX(M+1),T=a.getX(M+2);r=ls(this,u,e,i,l,f,d,b,g,T),r&&(r.faceIndex=Math.floor(M/3),r.face.materialIndex=p.materialIndex,t.push(r))}}else{let x=Math.max(0,m.start),v=Math.min(a.count,m.start+m.count);for(let p=x,u=v;p<u;p+=3){let y=a.getX(p),A=a.getX(p+1),M=a.getX(p+2);r=ls(this,s,e,i,l,f,d,y,A,M),r&&(r.faceIndex=Math.floor(p/3),t.push(r))}}else if(c!==void 0)if(Array.isArray(s))for(let x=0,v=h.length;x<v;x++){let p=h[x],u=s[p.materialIndex],y=Math.max(p.start,m.start),A=Math.min(c.count,Math.min(p.start+p.count,m.start+m.count));for(let M=y,C=A;M<C;M+=3){let b=M,g=M+1,T=M+2;r=ls(this,u,e,i,l,f,d,b,g,T),r&&(r.faceIndex=Math.floor(M/3),r.face.materialIndex=p.materialIndex,t.push(r))}}else{let x=Math.max(0,m.start),v=Math.min(c.count,m.start+m.count);for(let p=x,u=v;p<u;p+=3){let y=p,A=p+1,M=p+2;r=ls(this,s,e,i,l,f,d,y,A,M),r&&(r.faceIndex=Math.floor(p/3),t.push(r))}}}};function Jd(n,e,t,i,r,o,s,a){let c;if(e.side===at?c=i.intersectTriangle(s,o,r,!0,a):c=i.intersectTriangle(r,o,s,e.side===li,a),c===null)return null;as.copy(a),as.applyMatrix4(n.matrixWorld);let l=t.ray.origin.distanceTo(as);return l<t.near||l>t.far?null:{distance:l,point:as.clone(),object:n}}function ls(n,e,t,i,r,o,s,a,c,l){n.getVertexPosition(a,ns),n.getVertexPosition(c,rs),n.getVertexPosition(l,os);let f=Jd(n,e,t,i,ns,rs,os,nc);if(f){let d=new I;qi.getBarycoord(nc,ns,rs,os,d),r&&(f.uv=qi.getInterpolatedAttribute(r,a,c,l,d,new ye)),o&&(f.uv1=qi.getInterpolatedAttribute(o,a,c,l,d,new ye)),s&&(f.normal=qi.getInterpolatedAttribute(s,a,c,l,d,new I),f.normal.dot(i.direction)>0&&f.normal.multiplyScalar(-1));let h={a,b:c,c:l,normal:new I,materialIndex:0};qi.getNormal(ns,rs,os,h.normal),f.face=h,f.barycoord=d}return f}var Ki=class extends lt{constructor(e=null,t=1,i=1,r,o,s,a,c,l=et,f=et,d,h){super(null,s,a,c,l,f,r,o,d,h),this.isDataTexture=!0,this.image={data:e,width:t,height:i},this.generateMipmaps=!1,this.flipY=!1,this.unpackAlignment=1}};var mn=class extends $t{constructor(e,t,i,r=1){super(e,t,i),this.isInstancedBufferAttribute=!0,this.meshPerAttribute=r}copy(e){return super.copy(e),this.meshPerAttribute=e.meshPerAttribute,this}toJSON(){let e=super.toJSON();return e.meshPerAttribute=this.meshPerAttribute,e.isInstancedBufferAttribute=!0,e}};var Kn=new we,rc=new we,cs=[],oc=new Jt,$d=new we,oo=new Ot,so=new Ct,fs=class extends Ot{constructor(e,t,i){super(e,t),this.isInstancedMesh=!0,this.instanceMatrix=new mn(new Float32Array(i*16),16),this.instanceColor=null,this.morphTexture=null,this.count=i,this.boundingBox=null,this.boundingSphere=null;for(let r=0;r<i;r++)this.setMatrixAt(r,$d)}computeBoundingBox(){let e=this.geometry,t=this.count;this.boundingBox===null&&(this.boundingBox=new Jt),e.boundingBox===null&&e.computeBoundingBox(),this.boundingBox.makeEmpty();for(let i=0;i<t;i++)this.getMatrixAt(i,Kn),oc.copy(e.boundingBox).applyMatrix4(Kn),this.boundingBox.union(oc)}computeBoundingSphere(){let e=this.geometry,t=this.count;this.boundingSphere===null&&(this.boundingSphere=new Ct),e.boundingSphere===null&&e.computeBoundingSphere(),this.boundingSphere.makeEmpty();for(let i=0;i<t;i++)this.getMatrixAt(i,Kn),so.copy(e.boundingSphere).applyMatrix4(Kn),this.boundingSphere.union(so)}copy(e,t){return super.copy(e,t),this.instanceMatrix.copy(e.instanceMatrix),this.morphTexture=e.morphTexture!==null?e.morphTexture.clone():null,this.instanceColor=e.instanceColor!==null?e.instanceColor.clone():null,this.count=e.count,this.boundingBox=e.boundingBox!==null?e.boundingBox.clone():null,this.boundingSphere=e.boundingSphere!==null?e.boundingSphere.clone():null,this}getColorAt(e,t){return this.instanceColor===null?t.setRGB(1,1,1):t.fromArray(this.instanceColor.array,e*3)}getMatrixAt(e,t){return t.fromArray(this.instanceMatrix.array,e*16)}getMorphAt(e,t){let i=t.morphTargetInfluences,r=this.morphTexture.source.data.data,o=i.length+1,s=e*o+1;for(let a=0;a<i.length;a++)i[a]=r[s+a]}raycast(e,t){let i=this.matrixWorld,r=this.count;if(oo.geometry=this.geometry,oo.material=this.material,oo.material!==void 0&&(this.boundingSphere===null&&this.computeBoundingSphere(),so.copy(this.boundingSphere),so.applyMatrix4(i),e.ray.intersectsSphere(so)!==!1))for(let o=0;o<r;o++){this.getMatrixAt(o,Kn),rc.multiplyMatrices(i,Kn),oo.matrixWorld=rc,oo.raycast(e,cs);for(let s=0,a=cs.length;s<a;s++){let c=cs[s];c.instanceId=o,c.object=this,t.push(c)}cs.length=0}}setColorAt(e,t){return this.instanceColor===null&&(this.instanceColor=new mn(new Float32Array(this.instanceMatrix.count*3).fill(1),3)),t.toArray(this.instanceColor.array,e*3),this}setMatrixAt(e,t){return t.toArray(this.instanceMatrix.array,e*16),this}setMorphAt(e,t){let i=t.morphTargetInfluences,r=i.length+1;this.morphTexture===null&&(this.morphTexture=new Ki(new Float32Array(r*this.count),r,this.count,En,ut));let o=this.morphTexture.source.data.data,s=0;for(let l=0;l<i.length;l++)s+=i[l];let a=this.geometry.morphTargetsRelative?1:1-s,c=r*e;return o[c]=a,o.set(i,c+1),this}updateMorphTargets(){}dispose(){super.dispose(),this.instanceMatrix.dispose(),this.instanceColor!==null&&this.instanceColor.dispose(),this.morphTexture!==null&&(this.morphTexture.dispose(),this.morphTexture=null)}};var gn=new Ct,Qd=new ye(.5,.5),us=new I,ii=class{constructor(e=new Vt,t=new Vt,i=new Vt,r=new Vt,o=new Vt,s=new Vt){this.planes=[e,t,i,r,o,s]}set(e,t,i,r,o,s){let a=this.planes;return a[0].copy(e),a[1].copy(t),a[2].copy(i),a[3].copy(r),a[4].copy(o),a[5].copy(s),this}copy(e){let t=this.planes;for(let i=0;i<6;i++)t[i].copy(e.planes[i]);return this}setFromProjectionMatrix(e,t=wt,i=!1){let r=this.planes,o=e.elements,s=o[0],a=o[1],c=o[2],l=o[3],f=o[4],d=o[5],h=o[6],m=o[7],x=o[8],v=o[9],p=o[10],u=o[11],y=o[12],A=o[13],M=o[14],C=o[15];if(r[0].setComponents(l-s,m-f,u-x,C-y).normalize(),r[1].setComponents(l+s,m+f,u+x,C+y).normalize(),r[2].setComponents(l+a,m+d,u+v,C+A).normalize(),r[3].setComponents(l-a,m-d,u-v,C-A).normalize(),i)r[4].setComponents(c,h,p,M).normalize(),r[5].setComponents(l-c,m-h,u-p,C-M).normalize();else if(r[4].setComponents(l-c,m-h,u-p,C-M).normalize(),t===wt)r[5].setComponents(l+c,m+h,u+p,C+M).normalize();else if(t===Pi)r[5].setComponents(c,h,p,M).normalize();else throw new Error("THREE.Frustum.setFromProjectionMatrix(): Invalid coordinate system: "+t);return this}intersectsObject(e){if(e.boundingSphere!==void 0)e.boundingSphere===null&&e.computeBoundingSphere(),gn.copy(e.boundingSphere).applyMatrix4(e.matrixWorld);else{let t=e.geometry;t.boundingSphere===null&&t.computeBoundingSphere(),gn.copy(t.boundingSphere).applyMatrix4(e.matrixWorld)}return this.intersectsSphere(gn)}intersectsSprite(e){gn.center.set(0,0,0);let t=Qd.distanceTo(e.center);return gn.radius=.7071067811865476+t,gn.applyMatrix4(e.matrixWorld),this.intersectsSphere(gn)}intersectsSphere(e){let t=this.planes,i=e.center,r=-e.radius;for(let o=0;o<6;o++)if(t[o].distanceToPoint(i)<r)return!1;return!0}intersectsBox(e){let t=this.planes;for(let i=0;i<6;i++){let r=t[i];if(us.x=r.normal.x>0?e.max.x:e.min.x,us.y=r.normal.y>0?e.max.y:e.min.y,us.z=r.normal.z>0?e.max.z:e.min.z,r.distanceToPoint(us)<0)return!1}return!0}containsPoint(e){let t=this.planes;for(let i=0;i<6;i++)if(t[i].distanceToPoint(e)<0)return!1;return!0}clone(){return new this.constructor().copy(this)}};var sc=new we,hs=class n{constructor(){this.coordinateSystem=wt,this._frustums=[],this._count=0}setFromArrayCamera(e){let t=e.cameras,i=this._frustums;for(let r=0;r<t.length;r++){let o=t[r];sc.multiplyMatrices(o.projectionMatrix,o.matrixWorldInverse),i[r]===void 0&&(i[r]=new ii),i[r].setFromProjectionMatrix(sc,o.coordinateSystem,o.reversedDepth)}return this._count=t.length,this}getFrustum(e){return this._frustums[e]}intersectsObject(e){let t=this._frustums;for(let i=0;i<this._count;i++)if(t[i].intersectsObject(e))return!0;return!1}intersectsSprite(e){let t=this._frustums;for(let i=0;i<this._count;i++)if(t[i].intersectsSprite(e))return!0;return!1}intersectsSphere(e){let t=this._frustums;for(let i=0;i<this._count;i++)if(t[i].intersectsSphere(e))return!0;return!1}intersectsBox(e){let t=this._frustums;for(let i=0;i<this._count;i++)if(t[i].intersectsBox(e))return!0;return!1}containsPoint(e){let t=this._frustums;for(let i=0;i<this._count;i++)if(t[i].containsPoint(e))return!0;return!1}copy(e){this.coordinateSystem=e.coordinateSystem;let t=this._frustums,i=e._frustums;for(let r=0;r<e._count;r++)t[r]===void 0&&(t[r]=new ii),t[r].copy(i[r]);return this._count=e._count,this}clone(){return new n().copy(this)}};var Jn=class extends dt{constructor(e){super(),this.isLineBasicMaterial=!0,this.type="LineBasicMaterial",this.color=new Me(16777215),this.map=null,this.linewidth=1,this.linecap="round",this.linejoin="round",this.fog=!0,this.setValues(e)}copy(e){return super.copy(e),this.color.copy(e.color),this.map=e.map,this.linewidth=e.linewidth,this.linecap=e.linecap,this.linejoin=e.linejoin,this.fog=e.fog,this}};var ms=new I,gs=new I,ac=new we,ao=new yi,ds=new Ct,ba=new I,lc=new I,$n=class extends Xe{constructor(e=new nt,t=new Jn){super(),this.isLine=!0,this.type="Line",this.geometry=e,this.material=t,this.morphTargetDictionary=void 0,this.morphTargetInfluences=void 0,this.updateMorphTargets()}copy(e,t){return super.copy(e,t),e.morphTargetInfluences!==void 0?this.morphTargetInfluences=e.morphTargetInfluences.slice():this.morphTargetInfluences=void 0,e.morphTargetDictionary!==void 0?this.morphTargetDictionary=Object.assign({},e.morphTargetDictionary):this.morphTargetDictionary=void 0,this.material=Array.isArray(e.material)?e.material.slice():e.material,this.geometry=e.geometry,this}computeLineDistances(){let e=this.geometry;if(e.index===null){let t=e.attributes.position,i=[0];for(let r=1,o=t.count;r<o;r++)ms.fromBufferAttribute(t,r-1),gs.fromBufferAttribute(t,r),i[r]=i[r-1],i[r]+=ms.distanceTo(gs);e.setAttribute("lineDistance",new $e(i,1))}else pe("Line.computeLineDistances(): Computation only possible with non-indexed BufferGeometry.");return this}intersectsFrustum(e){return e.intersectsObject(this)}raycast(e,t){let i=this.geometry,r=this.matrixWorld,o=e.params.Line.threshold,s=i.drawRange;if(i.boundingSphere===null&&i.computeBoundingSphere(),ds.copy(i.boundingSphere),ds.applyMatrix4(r),ds.radius+=o,e.ray.intersectsSphere(ds)===!1)return;ac.copy(r).invert(),ao.copy(e.ray).applyMatrix4(ac);let a=o/((this.scale.x+this.scale.y+this.scale.z)/3),c=a*a,l=this.isLineSegments?2:1,f=i.index,h=i.attributes.position;if(f!==null){let m=Math.max(0,s.start),x=Math.min(f.count,s.start+s.count);for(let v=m,p=x-1;v<p;v+=l){let u=f.getX(v),y=f.getX(v+1),A=ps(this,e,ao,c,u,y,v);A&&t.push(A)}if(this.isLineLoop){let v=f.getX(x-1),p=f.getX(m),u=ps(this,e,ao,c,v,p,x-1);u&&t.push(u)}}else{let m=Math.max(0,s.start),x=Math.min(h.count,s.start+s.count);for(let v=m,p=x-1;v<p;v+=l){let u=ps(this,e,ao,c,v,v+1,v);u&&t.push(u)}if(this.isLineLoop){let v=ps(this,e,ao,c,x-1,m,x-1);v&&t.push(v)}}}updateMorphTargets(){let t=this.geometry.morphAttributes,i=Object.keys(t);if(i.length>0){let r=t[i[0]];if(r!==void 0){this.morphTargetInfluences=[],this.morphTargetDictionary={};for(let o=0,s=r.length;o<s;o++){let a=r[o].name||String(o);this.morphTargetInfluences.push(0),this.morphTargetDictionary[a]=o}}}}};function ps(n,e,t,i,r,o,s){let a=n.geometry.attributes.position;if(ms.fromBufferAttribute(a,r),gs.fromBufferAttribute(a,o),t.distanceSqToSegment(ms,gs,ba,lc)>i)return;ba.applyMatrix4(n.matrixWorld);let l=e.ray.origin.distanceTo(ba);if(!(l<e.near||l>e.far))return{distance:l,point:lc.clone().applyMatrix4(n.matrixWorld),index:s,face:null,faceIndex:null,barycoord:null,object:n}}var cc=new I,fc=new I,_s=class extends $n{constructor(e,t){super(e,t),this.isLineSegments=!0,this.type="LineSegments"}computeLineDistances(){let e=this.geometry;if(e.index===null){let t=e.attributes.position,i=[];for(let r=0,o=t.count;r<o;r+=2)cc.fromBufferAttribute(t,r),fc.fromBufferAttribute(t,r+1),i[r]=r===0?0:i[r-1],i[r+1]=i[r]+cc.distanceTo(fc);e.setAttribute("lineDistance",new $e(i,1))}else pe("LineSegments.computeLineDistances(): Computation only possible with non-indexed BufferGeometry.");return this}};var xs=class extends dt{constructor(e){super(),this.isPointsMaterial=!0,this.type="PointsMaterial",this.color=new Me(16777215),this.map=null,this.alphaMap=null,this.size=1,this.sizeAttenuation=!0,this.fog=!0,this.setValues(e)}copy(e){return super.copy(e),this.color.copy(e.color),this.map=e.map,this.alphaMap=e.alphaMap,this.size=e.size,this.sizeAttenuation=e.sizeAttenuation,this.fog=e.fog,this}};var uc=new we,Ra=new yi,Ss=new Ct,Ms=new I,vs=class extends Xe{constructor(e=new nt,t=new xs){super(),this.isPoints=!0,this.type="Points",this.geometry=e,this.material=t,this.morphTargetDictionary=void 0,this.morphTargetInfluences=void 0,this.updateMorphTargets()}copy(e,t){return super.copy(e,t),e.morphTargetInfluences!==void 0?this.morphTargetInfluences=e.morphTargetInfluences.slice():this.morphTargetInfluences=void 0,e.morphTargetDictionary!==void 0?this.morphTargetDictionary=Object.assign({},e.morphTargetDictionary):this.morphTargetDictionary=void 0,this.material=Array.isArray(e.material)?e.material.slice():e.material,this.geometry=e.geometry,this}intersectsFrustum(e){return e.intersectsObject(this)}raycast(e,t){let i=this.geometry,r=this.matrixWorld,o=e.params.Points.threshold,s=i.drawRange;if(i.boundingSphere===null&&i.computeBoundingSphere(),Ss.copy(i.boundingSphere),Ss.applyMatrix4(r),Ss.radius+=o,e.ray.intersectsSphere(Ss)===!1)return;uc.copy(r).invert(),Ra.copy(e.ray).applyMatrix4(uc);let a=o/((this.scale.x+this.scale.y+this.scale.z)/3),c=a*a,l=i.index,d=i.attributes.position;if(l!==null){let h=Math.max(0,s.start),m=Math.min(l.count,s.start+s.count);for(let x=h,v=m;x<v;x++){let p=l.getX(x);Ms.fromBufferAttribute(d,p),hc(Ms,p,c,r,e,t,this)}}else{let h=Math.max(0,s.start),m=Math.min(d.count,s.start+s.count);for(let x=h,v=m;x<v;x++)Ms.fromBufferAttribute(d,x),hc(Ms,x,c,r,e,t,this)}}updateMorphTargets(){let t=this.geometry.morphAttributes,i=Object.keys(t);if(i.length>0){let r=t[i[0]];if(r!==void 0){this.morphTargetInfluences=[],this.morphTargetDictionary={};for(let o=0,s=r.length;o<s;o++){let a=r[o].name||String(o);this.morphTargetInfluences.push(0),this.morphTargetDictionary[a]=o}}}}};function hc(n,e,t,i,r,o,s){let a=Ra.distanceSqToPoint(n);if(a<t){let c=new I;Ra.closestPointToPoint(n,c),c.applyMatrix4(i);let l=r.ray.origin.distanceTo(c);if(l<r.near||l>r.far)return;o.push({distance:l,distanceToRay:Math.sqrt(a),point:c,index:e,face:null,faceIndex:null,barycoord:null,object:s})}}var Qn=class extends lt{constructor(e=[],t=on,i,r,o,s,a,c,l,f){super(e,t,i,r,o,s,a,c,l,f),this.isCubeTexture=!0,this.flipY=!1}get images(){return this.image}set images(e){this.image=e}};var vi=class extends lt{constructor(e,t,i=Dt,r,o,s,a=et,c=et,l,f=ci,d=1){if(f!==ci&&f!==mi)throw new Error("THREE.DepthTexture: format must be either THREE.DepthFormat or THREE.DepthStencilFormat");let h={width:e,height:t,depth:d};super(h,r,o,s,a,c,f,i,l),this.isDepthTexture=!0,this.flipY=!1,this.generateMipmaps=!1,this.compareFunction=null}copy(e){return super.copy(e),this.source=new ki(Object.assign({},e.image)),this.compareFunction=e.compareFunction,this}toJSON(e){let t=super.toJSON(e);return t.compareFunction=this.compareFunction,t}};var jn=class extends vi{constructor(e,t=Dt,i=on,r,o,s=et,a=et,c,l=ci){let f={width:e,height:e,depth:1},d=[f,f,f,f,f,f];super(e,e,t,i,r,o,s,a,c,l),this.image=d,this.isCubeDepthTexture=!0,this.isCubeTexture=!0}get images(){return this.image}set images(e){this.image=e}};var er=class n extends nt{constructor(e=1,t=1,i=1,r=1,o=1,s=1){super(),this.type="BoxGeometry",this.parameters={width:e,height:t,depth:i,widthSegments:r,heightSegments:o,depthSegments:s};let a=this;r=Math.floor(r),o=Math.floor(o),s=Math.floor(s);let c=[],l=[],f=[],d=[],h=0,m=0;x("z","y","x",-1,-1,i,t,e,s,o,0),x("z","y","x",1,-1,i,t,-e,s,o,1),x("x","z","y",1,1,e,i,t,r,s,2),x("x","z","y",1,-1,e,i,-t,r,s,3),x("x","y","z",1,-1,e,t,i,r,o,4),x("x","y","z",-1,-1,e,t,-i,r,o,5),this.setIndex(c),this.setAttribute("position",new $e(l,3)),this.setAttribute("normal",new $e(f,3)),this.setAttribute("uv",new $e(d,2));function x(v,p,u,y,A,M,C,b,g,T,B){let D=M/g,U=C/T,z=M/2,$=C/2,P=b/2,W=g+1,K=T+1,H=0,te=0,k=new I;for(let J=0;J<K;J++){let Q=J*U-$;for(let Se=0;Se<W;Se++){let Ne=Se*D-z;k[v]=Ne*y,k[p]=Q*A,k[u]=P,l.push(k.x,k.y,k.z),k[v]=0,k[p]=0,k[u]=b>0?1:-1,f.push(k.x,k.y,k.z),d.push(Se/g),d.push(1-J/T),H+=1}}for(let J=0;J<T;J++)for(let Q=0;Q<g;Q++){let Se=h+Q+W*J,Ne=h+Q+W*(J+1),Fe=h+(Q+1)+W*(J+1),Qe=h+(Q+1)+W*J;c.push(Se,Ne,Qe),c.push(Ne,Fe,Qe),te+=6}a.addGroup(m,te,B),m+=te,h+=H}}copy(e){return super.copy(e),this.parameters=Object.assign({},e.parameters),this}static fromJSON(e){return new n(e.width,e.height,e.depth,e.widthSegments,e.heightSegments,e.depthSegments)}};var wa=class n extends nt{constructor(e=1,t=32,i=0,r=Math.PI*2){super(),this.type="CircleGeometry",this.parameters={radius:e,segments:t,thetaStart:i,thetaLength:r},t=Math.max(3,t);let o=[],s=[],a=[],c=[],l=new I,f=new ye;s.push(0,0,0),a.push(0,0,1),c.push(.5,.5);for(let d=0,h=3;d<=t;d++,h+=3){let m=i+d/t*r;l.x=e*Math.cos(m),l.y=e*Math.sin(m),s.push(l.x,l.y,l.z),a.push(0,0,1),f.x=(s[h]/e+1)/2,f.y=(s[h+1]/e+1)/2,c.push(f.x,f.y)}for(let d=1;d<=t;d++)o.push(d,d+1,0);this.setIndex(o),this.setAttribute("position",new $e(s,3)),this.setAttribute("normal",new $e(a,3)),this.setAttribute("uv",new $e(c,2))}copy(e){return super.copy(e),this.parameters=Object.assign({},e.parameters),this}static fromJSON(e){return new n(e.radius,e.segments,e.thetaStart,e.thetaLength)}};function La(n,e,t=2){let i=e&&e.length,r=i?e[0]*t:n.length,o=pc(n,0,r,t,!0),s=[];if(!o||o.next===o.prev)return s;let a,c,l;if(i&&(o=np(n,e,o,t)),n.length>80*t){a=n[0],c=n[1];let f=a,d=c;for(let h=t;h<r;h+=t){let m=n[h],x=n[h+1];m<a&&(a=m),x<c&&(c=x),m>f&&(f=m),x>d&&(d=x)}l=Math.max(f-a,d-c),l=l!==0?32767/l:0}return co(o,s,t,a,c,l,0),s}function pc(n,e,t,i,r){let o;if(r===pp(n,e,t,i)>0)for(let s=e;s<t;s+=i)o=dc(s/i|0,n[s],n[s+1],o);else for(let s=t-i;s>=e;s-=i)o=dc(s/i|0,n[s],n[s+1],o);return o&&tr(o,o.next)&&(uo(o),o=o.next),o}function _n(n,e){if(!n)return n;e||(e=n);let t=n,i;do if(i=!1,!t.steiner&&(tr(t,t.next)||st(t.prev,t,t.next)===0)){if(uo(t),t=e=t.prev,t===t.next)break;i=!0}else t=t.next;while(i||t!==e);return e}function co(n,e,t,i,r,o,s){if(!n)return;!s&&o&&lp(n,i,r,o);let a=n;for(;n.prev!==n.next;){let c=n.prev,l=n.next;if(o?ep(n,i,r,o):jd(n)){e.push(c.i,n.i,l.i),uo(n),n=l.next,a=l.next;continue}if(n=l,n===a){s?s===1?(n=tp(_n(n),e),co(n,e,t,i,r,o,2)):s===2&&ip(n,e,t,i,r,o):co(_n(n),e,t,i,r,o,1);break}}}function jd(n){let e=n.prev,t=n,i=n.next;if(st(e,t,i)>=0)return!1;let r=e.x,o=t.x,s=i.x,a=e.y,c=t.y,l=i.y,f=Math.min(r,o,s),d=Math.min(a,c,l),h=Math.max(r,o,s),m=Math.max(a,c,l),x=i.next;for(;x!==e;){if(x.x>=f&&x.x<=h&&x.y>=d&&x.y<=m&&lo(r,a,o,c,s,l,x.x,x.y)&&st(x.prev,x,x.next)>=0)return!1;x=x.next}return!0}function ep(n,e,t,i){let r=n.prev,o=n,s=n.next;if(st(r,o,s)>=0)return!1;let a=r.x,c=o.x,l=s.x,f=r.y,d=o.y,h=s.y,m=Math.min(a,c,l),x=Math.min(f,d,h),v=Math.max(a,c,l),p=Math.max(f,d,h),u=Ca(m,x,e,t,i),y=Ca(v,p,e,t,i),A=n.prevZ,M=n.nextZ;for(;A&&A.z>=u&&M&&M.z<=y;){if(A.x>=m&&A.x<=v&&A.y>=x&&A.y<=p&&A!==r&&A!==s&&lo(a,f,c,d,l,h,A.x,A.y)&&st(A.prev,A,A.next)>=0||(A=A.prevZ,M.x>=m&&M.x<=v&&M.y>=x&&M.y<=p&&M!==r&&M!==s&&lo(a,f,c,d,l,h,M.x,M.y)&&st(M.prev,M,M.next)>=0))return!1;M=M.nextZ}for(;A&&A.z>=u;){if(A.x>=m&&A.x<=v&&A.y>=x&&A.y<=p&&A!==r&&A!==s&&lo(a,f,c,d,l,h,A.x,A.y)&&st(A.prev,A,A.next)>=0)return!1;A=A.prevZ}for(;M&&M.z<=y;){if(M.x>=m&&M.x<=v&&M.y>=x&&M.y<=p&&M!==r&&M!==s&&lo(a,f,c,d,l,h,M.x,M.y)&&st(M.prev,M,M.next)>=0)return!1;M=M.nextZ}return!0}function tp(n,e){let t=n;do{let i=t.prev,r=t.next.next;!tr(i,r)&&gc(i,t,t.next,r)&&fo(i,r)&&fo(r,i)&&(e.push(i.i,t.i,r.i),uo(t),uo(t.next),t=n=r),t=t.next}while(t!==n);return _n(t)}function ip(n,e,t,i,r,o){let s=n;do{let a=s.next.next;for(;a!==s.prev;){if(s.i!==a.i&&up(s,a)){let c=_c(s,a);s=_n(s,s.next),c=_n(c,c.next),co(s,e,t,i,r,o,0),co(c,e,t,i,r,o,0);return}a=a.next}s=s.next}while(s!==n)}function np(n,e,t,i){let r=[];for(let o=0,s=e.length;o<s;o++){let a=e[o]*i,c=o<s-1?e[o+1]*i:n.length,l=pc(n,a,c,i,!1);l===l.next&&(l.steiner=!0),r.push(fp(l))}r.sort(rp);for(let o=0;o<r.length;o++)t=op(r[o],t);return t}function rp(n,e){let t=n.x-e.x;if(t===0&&(t=n.y-e.y,t===0)){let i=(n.next.y-n.y)/(n.next.x-n.x),r=(e.next.y-e.y)/(e.next.x-e.x);t=i-r}return t}function op(n,e){let t=sp(n,e);if(!t)return e;let i=_c(t,n);return _n(i,i.next),_n(t,t.next)}function sp(n,e){let t=e,i=n.x,r=n.y,o=-1/0,s;if(tr(n,t))return t;do{if(tr(n,t.next))return t.next;if(r<=t.y&&r>=t.next.y&&t.next.y!==t.y){let d=t.x+(r-t.y)*(t.next.x-t.x)/(t.next.y-t.y);if(d<=i&&d>o&&(o=d,s=t.x<t.next.x?t:t.next,d===i))return s}t=t.next}while(t!==e);if(!s)return null;let a=s,c=s.x,l=s.y,f=1/0;t=s;do{if(i>=t.x&&t.x>=c&&i!==t.x&&mc(r<l?i:o,r,c,l,r<l?o:i,r,t.x,t.y)){let d=Math.abs(r-t.y)/(i-t.x);fo(t,n)&&(d<f||d===f&&(t.x>s.x||t.x===s.x&&ap(s,t)))&&(s=t,f=d)}t=t.next}while(t!==a);return s}function ap(n,e){return st(n.prev,n,e.prev)<0&&st(e.next,n,n.next)<0}function lp(n,e,t,i){let r=n;do r.z===0&&(r.z=Ca(r.x,r.y,e,t,i)),r.prevZ=r.prev,r.nextZ=r.next,r=r.next;while(r!==n);r.prevZ.nextZ=null,r.prevZ=null,cp(r)}function cp(n){let e,t=1;do{let i=n,r;n=null;let o=null;for(e=0;i;){e++;let s=i,a=0;for(let l=0;l<t&&(a++,s=s.nextZ,!!s);l++);let c=t;for(;a>0||c>0&&s;)a!==0&&(c===0||!s||i.z<=s.z)?(r=i,i=i.nextZ,a--):(r=s,s=s.nextZ,c--),o?o.nextZ=r:n=r,r.prevZ=o,o=r;i=s}o.nextZ=null,t*=2}while(e>1);return n}function Ca(n,e,t,i,r){return n=(n-t)*r|0,e=(e-i)*r|0,n=(n|n<<8)&16711935,n=(n|n<<4)&252645135,n=(n|n<<2)&858993459,n=(n|n<<1)&1431655765,e=(e|e<<8)&16711935,e=(e|e<<4)&252645135,e=(e|e<<2)&858993459,e=(e|e<<1)&1431655765,n|e<<1}function fp(n){let e=n,t=n;do(e.x<t.x||e.x===t.x&&e.y<t.y)&&(t=e),e=e.next;while(e!==n);return t}function mc(n,e,t,i,r,o,s,a){return(r-s)*(e-a)>=(n-s)*(o-a)&&(n-s)*(i-a)>=(t-s)*(e-a)&&(t-s)*(o-a)>=(r-s)*(i-a)}function lo(n,e,t,i,r,o,s,a){return!(n===s&&e===a)&&mc(n,e,t,i,r,o,s,a)}function up(n,e){return n.next.i!==e.i&&n.prev.i!==e.i&&!hp(n,e)&&(fo(n,e)&&fo(e,n)&&dp(n,e)&&(st(n.prev,n,e.prev)||st(n,e.prev,e))||tr(n,e)&&st(n.prev,n,n.next)>0&&st(e.prev,e,e.next)>0)}function st(n,e,t){return(e.y-n.y)*(t.x-e.x)-(e.x-n.x)*(t.y-e.y)}function tr(n,e){return n.x===e.x&&n.y===e.y}function gc(n,e,t,i){let r=Ts(st(n,e,t)),o=Ts(st(n,e,i)),s=Ts(st(t,i,n)),a=Ts(st(t,i,e));return!!(r!==o&&s!==a||r===0&&Es(n,t,e)||o===0&&Es(n,i,e)||s===0&&Es(t,n,i)||a===0&&Es(t,e,i))}function Es(n,e,t){return e.x<=Math.max(n.x,t.x)&&e.x>=Math.min(n.x,t.x)&&e.y<=Math.max(n.y,t.y)&&e.y>=Math.min(n.y,t.y)}function Ts(n){return n>0?1:n<0?-1:0}function hp(n,e){let t=n;do{if(t.i!==n.i&&t.next.i!==n.i&&t.i!==e.i&&t.next.i!==e.i&&gc(t,t.next,n,e))return!0;t=t.next}while(t!==n);return!1}function fo(n,e){return st(n.prev,n,n.next)<0?st(n,e,n.next)>=0&&st(n,n.prev,e)>=0:st(n,e,n.prev)<0||st(n,n.next,e)<0}function dp(n,e){let t=n,i=!1,r=(n.x+e.x)/2,o=(n.y+e.y)/2;do t.y>o!=t.next.y>o&&t.next.y!==t.y&&r<(t.next.x-t.x)*(o-t.y)/(t.next.y-t.y)+t.x&&(i=!i),t=t.next;while(t!==n);return i}function _c(n,e){let t=Pa(n.i,n.x,n.y),i=Pa(e.i,e.x,e.y),r=n.next,o=e.prev;return n.next=e,e.prev=n,t.next=r,r.prev=t,i.next=t,t.prev=i,o.next=i,i.prev=o,i}function dc(n,e,t,i){let r=Pa(n,e,t);return i?(r.next=i.next,r.prev=i,i.next.prev=r,i.next=r):(r.prev=r,r.next=r),r}function uo(n){n.next.prev=n.prev,n.prev.next=n.next,n.prevZ&&(n.prevZ.nextZ=n.nextZ),n.nextZ&&(n.nextZ.prevZ=n.prevZ)}function Pa(n,e,t){return{i:n,x:e,y:t,prev:null,next:null,z:0,prevZ:null,nextZ:null,steiner:!1}}function pp(n,e,t,i){let r=0;for(let o=e,s=t-i;o<t;o+=i)r+=(n[s]-n[o])*(n[o+1]+n[s+1]),s=o;return r}var ys=class{static triangulate(e,t,i=2){return La(e,t,i)}};var As=class n{static area(e){let t=e.length,i=0;for(let r=t-1,o=0;o<t;r=o++)i+=e[r].x*e[o].y-e[o].x*e[r].y;return i*.5}static isClockWise(e){return n.area(e)<0}static triangulateShape(e,t){let i=[],r=[],o=[];xc(e),Sc(i,e);let s=e.length;t.forEach(xc);for(let c=0;c<t.length;c++)r.push(s),s+=t[c].length,Sc(i,t[c]);let a=ys.triangulate(i,r);for(let c=0;c<a.length;c+=3)o.push(a.slice(c,c+3));return o}};function xc(n){let e=n.length;e>2&&n[e-1].equals(n[0])&&n.pop()}function Sc(n,e){for(let t=0;t<e.length;t++)n.push(e[t].x),n.push(e[t].y)}var bs=class n extends nt{constructor(e=1,t=1,i=1,r=1){super(),this.type="PlaneGeometry",this.parameters={width:e,height:t,widthSegments:i,heightSegments:r};let o=e/2,s=t/2,a=Math.floor(i),c=Math.floor(r),l=a+1,f=c+1,d=e/a,h=t/c,m=[],x=[],v=[],p=[];for(let u=0;u<f;u++){let y=u*h-s;for(let A=0;A<l;A++){let M=A*d-o;x.push(M,-y,0),v.push(0,0,1),p.push(A/a),p.push(1-u/c)}}for(let u=0;u<c;u++)for(let y=0;y<a;y++){let A=y+l*u,M=y+l*(u+1),C=y+1+l*(u+1),b=y+1+l*u;m.push(A,M,b),m.push(M,C,b)}this.setIndex(m),this.setAttribute("position",new $e(x,3)),this.setAttribute("normal",new $e(v,3)),this.setAttribute("uv",new $e(p,2))}copy(e){return super.copy(e),this.parameters=Object.assign({},e.parameters),this}static fromJSON(e){return new n(e.width,e.height,e.widthSegments,e.heightSegments)}};var Da=class n extends nt{constructor(e=1,t=32,i=16,r=0,o=Math.PI*2,s=0,a=Math.PI){super(),this.type="SphereGeometry",this.parameters={radius:e,widthSegments:t,heightSegments:i,phiStart:r,phiLength:o,thetaStart:s,thetaLength:a},t=Math.max(3,Math.floor(t)),i=Math.max(2,Math.floor(i));let c=Math.min(s+a,Math.PI),l=0,f=[],d=new I,h=new I,m=[],x=[],v=[],p=[];for(let u=0;u<=i;u++){let y=[],A=u/i,M=s+A*a,C=e*Math.cos(M),b=Math.sqrt(e*e-C*C),g=0;u===0&&s===0?g=.5/t:u===i&&c===Math.PI&&(g=-.5/t);for(let T=0;T<=t;T++){let B=T/t,D=r+B*o;d.x=-b*Math.cos(D),d.y=C,d.z=b*Math.sin(D),x.push(d.x,d.y,d.z),h.copy(d).normalize(),v.push(h.x,h.y,h.z),p.push(B+g,1-A),y.push(l++)}f.push(y)}for(let u=0;u<i;u++)for(let y=0;y<t;y++){let A=f[u][y+1],M=f[u][y],C=f[u+1][y],b=f[u+1][y+1];(u!==0||s>0)&&m.push(A,M,b),(u!==i-1||c<Math.PI)&&m.push(M,C,b)}this.setIndex(m),this.setAttribute("position",new $e(x,3)),this.setAttribute("normal",new $e(v,3)),this.setAttribute("uv",new $e(p,2))}copy(e){return super.copy(e),this.parameters=Object.assign({},e.parameters),this}static fromJSON(e){return new n(e.radius,e.widthSegments,e.heightSegments,e.phiStart,e.phiLength,e.thetaStart,e.thetaLength)}};function Fi(n){let e={};for(let t in n){e[t]={};for(let i in n[t]){let r=n[t][i];if(Mc(r))r.isRenderTargetTexture?(pe("UniformsUtils: Textures of render targets cannot be cloned via cloneUniforms() or mergeUniforms()."),e[t][i]=null):e[t][i]=r.clone();else if(Array.isArray(r))if(Mc(r[0])){let o=[];for(let s=0,a=r.length;s<a;s++)o[s]=r[s].clone();e[t][i]=o}else e[t][i]=r.slice();else e[t][i]=r}}return e}function Bt(n){let e={};for(let t=0;t<n.length;t++){let i=Fi(n[t]);for(let r in i)e[r]=i[r]}return e}function Mc(n){return n&&(n.isColor||n.isMatrix3||n.isMatrix4||n.isVector2||n.isVector3||n.isVector4||n.isTexture||n.isQuaternion)}function vc(n){let e=[];for(let t=0;t<n.length;t++)e.push(n[t].clone());return e}function Rs(n){let e=n.getRenderTarget();return e===null?n.outputColorSpace:e.isXRRenderTarget===!0?e.texture.colorSpace:Re.workingColorSpace}var Ec={clone:Fi,merge:Bt};var Tc=`
void main(){
gl_Position=projectionMatrix*modelViewMatrix*vec4( position,1. );
}
`;var yc=`
void main(){
gl_FragColor=vec4( 1.,.0,.0,1. );
}
`;var ni=class extends dt{constructor(e){super(),this.isShaderMaterial=!0,this.type="ShaderMaterial",this.defines={},this.uniforms={},this.uniformsGroups=[],this.vertexShader=Tc,this.fragmentShader=yc,this.linewidth=1,this.wireframe=!1,this.wireframeLinewidth=1,this.fog=!1,this.lights=!1,this.clipping=!1,this.forceSinglePass=!0,this.extensions={clipCullDistance:!1,multiDraw:!1},this.defaultAttributeValues={color:[1,1,1],uv:[0,0],uv1:[0,0]},this.index0AttributeName=void 0,this.uniformsNeedUpdate=!1,this.glslVersion=null,e!==void 0&&this.setValues(e)}copy(e){return super.copy(e),this.fragmentShader=e.fragmentShader,this.vertexShader=e.vertexShader,this.uniforms=Fi(e.uniforms),this.uniformsGroups=vc(e.uniformsGroups),this.defines=Object.assign({},e.defines),this.wireframe=e.wireframe,this.wireframeLinewidth=e.wireframeLinewidth,this.fog=e.fog,this.lights=e.lights,this.clipping=e.clipping,this.extensions=Object.assign({},e.extensions),this.glslVersion=e.glslVersion,this.defaultAttributeValues=Object.assign({},e.defaultAttributeValues),this.index0AttributeName=e.index0AttributeName,this.uniformsNeedUpdate=e.uniformsNeedUpdate,this}toJSON(e){let t=super.toJSON(e);t.glslVersion=this.glslVersion,t.uniforms={};for(let r in this.uniforms){let s=this.uniforms[r].value;s&&s.isTexture?t.uniforms[r]={type:"t",value:s.toJSON(e).uuid}:s&&s.isColor?t.uniforms[r]={type:"c",value:s.getHex()}:s&&s.isVector2?t.uniforms[r]={type:"v2",value:s.toArray()}:s&&s.isVector3?t.uniforms[r]={type:"v3",value:s.toArray()}:s&&s.isVector4?t.uniforms[r]={type:"v4",value:s.toArray()}:s&&s.isMatrix3?t.uniforms[r]={type:"m3",value:s.toArray()}:s&&s.isMatrix4?t.uniforms[r]={type:"m4",value:s.toArray()}:t.uniforms[r]={value:s}}Object.keys(this.defines).length>0&&(t.defines=this.defines),t.vertexShader=this.vertexShader,t.fragmentShader=this.fragmentShader,t.lights=this.lights,t.clipping=this.clipping;let i={};for(let r in this.extensions)this.extensions[r]===!0&&(i[r]=!0);return Object.keys(i).length>0&&(t.extensions=i),t}fromJSON(e,t){if(super.fromJSON(e,t),e.uniforms!==void 0)for(let i in e.uniforms){let r=e.uniforms[i];switch(this.uniforms[i]={},r.type){case"t":this.uniforms[i].value=t[r.value]||null;break;case"c":this.uniforms[i].value=new Me().setHex(r.value);break;case"v2":this.uniforms[i].value=new ye().fromArray(r.value);break;case"v3":this.uniforms[i].value=new I().fromArray(r.value);break;case"v4":this.uniforms[i].value=new We().fromArray(r.value);break;case"m3":this.uniforms[i].value=new Ee().fromArray(r.value);break;case"m4":this.uniforms[i].value=new we().fromArray(r.value);break;default:this.uniforms[i].value=r.value}}if(e.defines!==void 0&&(this.defines=e.defines),e.vertexShader!==void 0&&(this.vertexShader=e.vertexShader),e.fragmentShader!==void 0&&(this.fragmentShader=e.fragmentShader),e.glslVersion!==void 0&&(this.glslVersion=e.glslVersion),e.extensions!==void 0)for(let i in e.extensions)this.extensions[i]=e.extensions[i];return e.lights!==void 0&&(this.lights=e.lights),e.clipping!==void 0&&(this.clipping=e.clipping),this}};var ws=class extends ni{constructor(e){super(e),this.isRawShaderMaterial=!0,this.type="RawShaderMaterial"}};var Cs=class extends dt{constructor(e){super(),this.isMeshStandardMaterial=!0,this.type="MeshStandardMaterial",this.defines={STANDARD:""},this.color=new Me(16777215),this.roughness=1,this.metalness=0,this.map=null,this.lightMap=null,this.lightMapIntensity=1,this.aoMap=null,this.aoMapIntensity=1,this.emissive=new Me(0),this.emissiveIntensity=1,this.emissiveMap=null,this.bumpMap=null,this.bumpScale=1,this.normalMap=null,this.normalMapType=ln,this.normalScale=new ye(1,1),this.displacementMap=null,this.displacementScale=1,this.displacementBias=0,this.roughnessMap=null,this.metalnessMap=null,this.alphaMap=null,this.envMap=null,this.envMapRotation=new Kt,this.envMapIntensity=1,this.wireframe=!1,this.wireframeLinewidth=1,this.wireframeLinecap="round",this.wireframeLinejoin="round",this.flatShading=!1,this.fog=!0,this.setValues(e)}copy(e){return super.copy(e),this.defines={STANDARD:""},this.color.copy(e.color),this.roughness=e.roughness,this.metalness=e.metalness,this.map=e.map,this.lightMap=e.lightMap,this.lightMapIntensity=e.lightMapIntensity,this.aoMap=e.aoMap,this.aoMapIntensity=e.aoMapIntensity,this.emissive.copy(e.emissive),this.emissiveMap=e.emissiveMap,this.emissiveIntensity=e.emissiveIntensity,this.bumpMap=e.bumpMap,this.bumpScale=e.bumpScale,this.normalMap=e.normalMap,this.normalMapType=e.normalMapType,this.normalScale.copy(e.normalScale),this.displacementMap=e.displacementMap,this.displacementScale=e.displacementScale,this.displacementBias=e.displacementBias,this.roughnessMap=e.roughnessMap,this.metalnessMap=e.metalnessMap,this.alphaMap=e.alphaMap,this.envMap=e.envMap,this.envMapRotation.copy(e.envMapRotation),this.envMapIntensity=e.envMapIntensity,this.wireframe=e.wireframe,this.wireframeLinewidth=e.wireframeLinewidth,this.wireframeLinecap=e.wireframeLinecap,this.wireframeLinejoin=e.wireframeLinejoin,this.flatShading=e.flatShading,this.fog=e.fog,this}};var Ps=class extends dt{constructor(e){super(),this.isMeshLambertMaterial=!0,this.type="MeshLambertMaterial",this.color=new Me(16777215),this.map=null,this.lightMap=null,this.lightMapIntensity=1,this.aoMap=null,this.aoMapIntensity=1,this.emissive=new Me(0),this.emissiveIntensity=1,this.emissiveMap=null,this.bumpMap=null,this.bumpScale=1,this.normalMap=null,this.normalMapType=ln,this.normalScale=new ye(1,1),this.displacementMap=null,this.displacementScale=1,this.displacementBias=0,this.specularMap=null,this.alphaMap=null,this.envMap=null,this.envMapRotation=new Kt,this.combine=xn,this.reflectivity=1,this.envMapIntensity=1,this.refractionRatio=.98,this.wireframe=!1,this.wireframeLinewidth=1,this.wireframeLinecap="round",this.wireframeLinejoin="round",this.flatShading=!1,this.fog=!0,this.setValues(e)}copy(e){return super.copy(e),this.color.copy(e.color),this.map=e.map,this.lightMap=e.lightMap,this.lightMapIntensity=e.lightMapIntensity,this.aoMap=e.aoMap,this.aoMapIntensity=e.aoMapIntensity,this.emissive.copy(e.emissive),this.emissiveMap=e.emissiveMap,this.emissiveIntensity=e.emissiveIntensity,this.bumpMap=e.bumpMap,this.bumpScale=e.bumpScale,this.normalMap=e.normalMap,this.normalMapType=e.normalMapType,this.normalScale.copy(e.normalScale),this.displacementMap=e.displacementMap,this.displacementScale=e.displacementScale,this.displacementBias=e.displacementBias,this.specularMap=e.specularMap,this.alphaMap=e.alphaMap,this.envMap=e.envMap,this.envMapRotation.copy(e.envMapRotation),this.combine=e.combine,this.reflectivity=e.reflectivity,this.envMapIntensity=e.envMapIntensity,this.refractionRatio=e.refractionRatio,this.wireframe=e.wireframe,this.wireframeLinewidth=e.wireframeLinewidth,this.wireframeLinecap=e.wireframeLinecap,this.wireframeLinejoin=e.wireframeLinejoin,this.flatShading=e.flatShading,this.fog=e.fog,this}};var ir=class extends dt{constructor(e){super(),this.isMeshDepthMaterial=!0,this.type="MeshDepthMaterial",this.depthPacking=bl,this.map=null,this.alphaMap=null,this.displacementMap=null,this.displacementScale=1,this.displacementBias=0,this.wireframe=!1,this.wireframeLinewidth=1,this.setValues(e)}copy(e){return super.copy(e),this.depthPacking=e.depthPacking,this.map=e.map,this.alphaMap=e.alphaMap,this.displacementMap=e.displacementMap,this.displacementScale=e.displacementScale,this.displacementBias=e.displacementBias,this.wireframe=e.wireframe,this.wireframeLinewidth=e.wireframeLinewidth,this}};var nr=class extends dt{constructor(e){super(),this.isMeshDistanceMaterial=!0,this.type="MeshDistanceMaterial",this.map=null,this.alphaMap=null,this.displacementMap=null,this.displacementScale=1,this.displacementBias=0,this.setValues(e)}copy(e){return super.copy(e),this.map=e.map,this.alphaMap=e.alphaMap,this.displacementMap=e.displacementMap,this.displacementScale=e.displacementScale,this.displacementBias=e.displacementBias,this}};var Ia=class{constructor(e,t,i){let r=this,o=!1,s=0,a=0,c,l=[];this.onStart=void 0,this.onLoad=e,this.onProgress=t,this.onError=i,this._abortController=null,this.itemStart=function(f){a++,o===!1&&r.onStart!==void 0&&r.onStart(f,s,a),o=!0},this.itemEnd=function(f){s++,r.onProgress!==void 0&&r.onProgress(f,s,a),s===a&&(o=!1,r.onLoad!==void 0&&r.onLoad())},this.itemError=function(f){r.onError!==void 0&&r.onError(f)},this.resolveURL=function(f){return f=f.normalize("NFC"),c?c(f):f},this.setURLModifier=function(f){return c=f,this},this.addHandler=function(f,d){return l.push(f,d),this},this.removeHandler=function(f){let d=l.indexOf(f);return d!==-1&&l.splice(d,2),this},this.getHandler=function(f){for(let d=0,h=l.length;d<h;d+=2){let m=l[d],x=l[d+1];if(m.global&&(m.lastIndex=0),m.test(f))return x}return null},this.abort=function(){return this.abortController.abort(),this._abortController=null,this}}get abortController(){return this._abortController||(this._abortController=new AbortController),this._abortController}},Ac=new Ia;var ho=class{constructor(e){this.manager=e!==void 0?e:Ac,this.crossOrigin="anonymous",this.withCredentials=!1,this.path="",this.resourcePath="",this.requestHeader={},this.priority="auto",this.cache="default",typeof __THREE_DEVTOOLS__<"u"&&__THREE_DEVTOOLS__.dispatchEvent(new CustomEvent("observe",{detail:this}))}load(){}loadAsync(e,t){let i=this;return new Promise(function(r,o){i.load(e,r,t,o)})}parse(){}setCrossOrigin(e){return this.crossOrigin=e,this}setWithCredentials(e){return this.withCredentials=e,this}setPath(e){return this.path=e,this}setResourcePath(e){return this.resourcePath=e,this}setRequestHeader(e){return this.requestHeader=e,this}setPriority(e){return this.priority=e,this}setCache(e){return this.cache=e,this}abort(){return this}};ho.DEFAULT_MATERIAL_NAME="__DEFAULT";var rr=class extends Xe{static registerNode(e){this.prototype._lightNode=e}constructor(e,t=1){super(),this.isLight=!0,this.type="Light",this.color=new Me(e),this.intensity=t}copy(e,t){return super.copy(e,t),this.color.copy(e.color),this.intensity=e.intensity,this}toJSON(e){let t=super.toJSON(e);return t.object.color=this.color.getHex(),t.object.intensity=this.intensity,t}};var Ls=class extends rr{constructor(e,t,i){super(e,i),this.isHemisphereLight=!0,this.type="HemisphereLight",this.position.copy(Xe.DEFAULT_UP),this.updateMatrix(),this.groundColor=new Me(t)}copy(e,t){return super.copy(e,t),this.groundColor.copy(e.groundColor),this}toJSON(e){let t=super.toJSON(e);return t.object.groundColor=this.groundColor.getHex(),t}};var Ua=new we,bc=new I,Rc=new I,Ds=class{constructor(e){this.camera=e,this.intensity=1,this.bias=0,this.biasNode=null,this.normalBias=0,this.radius=1,this.blurSamples=8,this.mapSize=new ye(512,512),this.mapType=Tt,this.map=null,this.mapPass=null,this.matrix=new we,this.autoUpdate=!0,this.needsUpdate=!1,this._frustum=new ii,this._frameExtents=new ye(1,1),this._viewportCount=1,this._viewports=[new We(0,0,1,1)]}getViewportCount(){return this._viewportCount}getCamera(){return this.camera}getFrustum(){return this._frustum}updateMatrices(e){let t=this.camera;bc.setFromMatrixPosition(e.matrixWorld),t.position.copy(bc),Rc.setFromMatrixPosition(e.target.matrixWorld),t.lookAt(Rc),t.updateMatrixWorld(),this._updateMatrix(t,this.matrix,this._frustum)}_updateMatrix(e,t,i,r){Ua.multiplyMatrices(e.projectionMatrix,e.matrixWorldInverse),i.setFromProjectionMatrix(Ua,e.coordinateSystem,e.reversedDepth);let o=this._frameExtents,s=r?r.z/o.x:1,a=r?r.w/o.y:1,c=r?r.x/o.x:0,l=r?r.y/o.y:0;e.coordinateSystem===Pi||e.reversedDepth?t.set(.5*s,0,0,.5*s+c,0,.5*a,0,.5*a+l,0,0,1,0,0,0,0,1):t.set(.5*s,0,0,.5*s+c,0,.5*a,0,.5*a+l,0,0,.5,.5,0,0,0,1),t.multiply(Ua)}getViewport(e){return this._viewports[e]}getFrameExtents(){return this._frameExtents}dispose(){this.map&&this.map.dispose(),this.mapPass&&this.mapPass.dispose()}copy(e){return this.camera=e.camera.clone(),this.intensity=e.intensity,this.bias=e.bias,this.radius=e.radius,this.autoUpdate=e.autoUpdate,this.needsUpdate=e.needsUpdate,this.normalBias=e.normalBias,this.blurSamples=e.blurSamples,this.mapSize.copy(e.mapSize),this.mapType=e.mapType,this.biasNode=e.biasNode,this}clone(){return new this.constructor().copy(this)}toJSON(){let e={};return e.intensity=this.intensity,e.bias=this.bias,e.normalBias=this.normalBias,e.radius=this.radius,e.blurSamples=this.blurSamples,e.mapSize=this.mapSize.toArray(),e.mapType=this.mapType,e.camera=this.camera.toJSON(!1).object,delete e.camera.matrix,e}};var Is=new I,Us=new Zt,Ai=new I,or=class extends Xe{constructor(){super(),this.isCamera=!0,this.type="Camera",this.matrixWorldInverse=new we,this.projectionMatrix=new we,this.projectionMatrixInverse=new we,this.coordinateSystem=wt,this._reversedDepth=!1}get reversedDepth(){return this._reversedDepth}copy(e,t){return super.copy(e,t),this.matrixWorldInverse.copy(e.matrixWorldInverse),this.projectionMatrix.copy(e.projectionMatrix),this.projectionMatrixInverse.copy(e.projectionMatrixInverse),this.coordinateSystem=e.coordinateSystem,this}getWorldDirection(e){return super.getWorldDirection(e).negate()}updateMatrixWorld(e){super.updateMatrixWorld(e),this.matrixWorld.decompose(Is,Us,Ai),Ai.x===1&&Ai.y===1&&Ai.z===1?this.matrixWorldInverse.copy(this.matrixWorld).invert():this.matrixWorldInverse.compose(Is,Us,Ai.set(1,1,1)).invert()}updateWorldMatrix(e,t,i=!1){super.updateWorldMatrix(e,t,i),this.matrixWorld.decompose(Is,Us,Ai),Ai.x===1&&Ai.y===1&&Ai.z===1?this.matrixWorldInverse.copy(this.matrixWorld).invert():this.matrixWorldInverse.compose(Is,Us,Ai.set(1,1,1)).invert()}clone(){return new this.constructor().copy(this)}};var Ji=new I,wc=new ye,Cc=new ye,Ei=class extends or{constructor(e=50,t=1,i=.1,r=2e3){super(),this.isPerspectiveCamera=!0,this.type="PerspectiveCamera",this.fov=e,this.zoom=1,this.near=i,this.far=r,this.focus=10,this.aspect=t,this.view=null,this.filmGauge=35,this.filmOffset=0,this.updateProjectionMatrix()}copy(e,t){return super.copy(e,t),this.fov=e.fov,this.zoom=e.zoom,this.near=e.near,this.far=e.far,this.focus=e.focus,this.aspect=e.aspect,this.view=e.view===null?null:Object.assign({},e.view),this.filmGauge=e.filmGauge,this.filmOffset=e.filmOffset,this}setFocalLength(e){let t=.5*this.getFilmHeight()/e;this.fov=eo*2*Math.atan(t),this.updateProjectionMatrix()}getFocalLength(){let e=Math.tan(Dn*.5*this.fov);return .5*this.getFilmHeight()/e}getEffectiveFOV(){return eo*2*Math.atan(Math.tan(Dn*.5*this.fov)/this.zoom)}getFilmWidth(){return this.filmGauge*Math.min(this.aspect,1)}getFilmHeight(){return this.filmGauge/Math.max(this.aspect,1)}getViewBounds(e,t,i){Ji.set(-1,-1,.5).applyMatrix4(this.projectionMatrixInverse),t.set(Ji.x,Ji.y).multiplyScalar(-e/Ji.z),Ji.set(1,1,.5).applyMatrix4(this.projectionMatrixInverse),i.set(Ji.x,Ji.y).multiplyScalar(-e/Ji.z)}getViewSize(e,t){return this.getViewBounds(e,wc,Cc),t.subVectors(Cc,wc)}setViewOffset(e,t,i,r,o,s){this.aspect=e/t,this.view===null&&(this.view={enabled:!0,fullWidth:1,fullHeight:1,offsetX:0,offsetY:0,width:1,height:1}),this.view.enabled=!0,this.view.fullWidth=e,this.view.fullHeight=t,this.view.offsetX=i,this.view.offsetY=r,this.view.width=o,this.view.height=s,this.updateProjectionMatrix()}clearViewOffset(){this.view!==null&&(this.view.enabled=!1),this.updateProjectionMatrix()}updateProjectionMatrix(){let e=this.near,t=e*Math.tan(Dn*.5*this.fov)/this.zoom,i=2*t,r=this.aspect*i,o=-.5*r,s=this.view;if(this.view!==null&&this.view.enabled){let c=s.fullWidth,l=s.fullHeight;o+=s.offsetX*r/c,t-=s.offsetY*i/l,r*=s.width/c,i*=s.height/l}let a=this.filmOffset;a!==0&&(o+=e*a/this.getFilmWidth()),this.projectionMatrix.makePerspective(o,o+r,t,t-i,e,this.far,this.coordinateSystem,this.reversedDepth),this.projectionMatrixInverse.copy(this.projectionMatrix).invert()}toJSON(e){let t=super.toJSON(e);return t.object.fov=this.fov,t.object.zoom=this.zoom,t.object.near=this.near,t.object.far=this.far,t.object.focus=this.focus,t.object.aspect=this.aspect,this.view!==null&&(t.object.view=Object.assign({},this.view)),t.object.filmGauge=this.filmGauge,t.object.filmOffset=this.filmOffset,t}};var $i=class extends or{constructor(e=-1,t=1,i=1,r=-1,o=.1,s=2e3){super(),this.isOrthographicCamera=!0,this.type="OrthographicCamera",this.zoom=1,this.view=null,this.left=e,this.right=t,this.top=i,this.bottom=r,this.near=o,this.far=s,this.updateProjectionMatrix()}copy(e,t){return super.copy(e,t),this.left=e.left,this.right=e.right,this.top=e.top,this.bottom=e.bottom,this.near=e.near,this.far=e.far,this.zoom=e.zoom,this.view=e.view===null?null:Object.assign({},e.view),this}setViewOffset(e,t,i,r,o,s){this.view===null&&(this.view={enabled:!0,fullWidth:1,fullHeight:1,offsetX:0,offsetY:0,width:1,height:1}),this.view.enabled=!0,this.view.fullWidth=e,this.view.fullHeight=t,this.view.offsetX=i,this.view.offsetY=r,this.view.width=o,this.view.height=s,this.updateProjectionMatrix()}clearViewOffset(){this.view!==null&&(this.view.enabled=!1),this.updateProjectionMatrix()}updateProjectionMatrix(){let e=(this.right-this.left)/(2*this.zoom),t=(this.top-this.bottom)/(2*this.zoom),i=(this.right+this.left)/2,r=(this.top+this.bottom)/2,o=i-e,s=i+e,a=r+t,c=r-t;if(this.view!==null&&this.view.enabled){let l=(this.right-this.left)/this.view.fullWidth/this.zoom,f=(this.top-this.bottom)/this.view.fullHeight/this.zoom;o+=l*this.view.offsetX,s=o+l*this.view.width,a-=f*this.view.offsetY,c=a-f*this.view.height}this.projectionMatrix.makeOrthographic(o,s,a,c,this.near,this.far,this.coordinateSystem,this.reversedDepth),this.projectionMatrixInverse.copy(this.projectionMatrix).invert()}toJSON(e){let t=super.toJSON(e);return t.object.zoom=this.zoom,t.object.left=this.left,t.object.right=this.right,t.object.top=this.top,t.object.bottom=this.bottom,t.object.near=this.near,t.object.far=this.far,this.view!==null&&(t.object.view=Object.assign({},this.view)),t}};var Ns=class extends Ds{constructor(){super(new $i(-5,5,5,-5,.5,500)),this.isDirectionalLightShadow=!0}};var Fs=class extends rr{constructor(e,t){super(e,t),this.isDirectionalLight=!0,this.type="DirectionalLight",this.position.copy(Xe.DEFAULT_UP),this.updateMatrix(),this.target=new Xe,this.shadow=new Ns}dispose(){super.dispose(),this.shadow.dispose()}copy(e){return super.copy(e),this.target=e.target.clone(),this.shadow=e.shadow.clone(),this}toJSON(e){let t=super.toJSON(e);return t.object.shadow=this.shadow.toJSON(),t.object.target=this.target.uuid,t}};var Os=class{static extractUrlBase(e){let t=e.lastIndexOf("/");return t===-1?"./":e.slice(0,t+1)}static resolveURL(e,t){return typeof e!="string"||e===""?"":(/^https?:\/\//i.test(t)&&/^\//.test(e)&&(t=t.replace(/(^https?:\/\/[^\/]+).*/i,"$1")),/^(https?:)?\/\//i.test(e)||/^data:.*,.*$/i.test(e)||/^blob:.*$/i.test(e)?e:t+e)}};var Bs=class extends nt{constructor(){super(),this.isInstancedBufferGeometry=!0,this.type="InstancedBufferGeometry",this.instanceCount=1/0}copy(e){return super.copy(e),this.instanceCount=e.instanceCount,this}toJSON(){let e=super.toJSON();return e.instanceCount=this.instanceCount,e.isInstancedBufferGeometry=!0,e}};var sr=-90,ar=1,Gs=class extends Xe{constructor(e,t,i){super(),this.type="CubeCamera",this.renderTarget=i,this.coordinateSystem=null,this.activeMipmapLevel=0;let r=new Ei(sr,ar,e,t);r.layers=this.layers,this.add(r);let o=new Ei(sr,ar,e,t);o.layers=this.layers,this.add(o);let s=new Ei(sr,ar,e,t);s.layers=this.layers,this.add(s);let a=new Ei(sr,ar,e,t);a.layers=this.layers,this.add(a);let c=new Ei(sr,ar,e,t);c.layers=this.layers,this.add(c);let l=new Ei(sr,ar,e,t);l.layers=this.layers,this.add(l)}updateCoordinateSystem(){let e=this.coordinateSystem,t=this.children.concat(),[i,r,o,s,a,c]=t;for(let l of t)this.remove(l);if(e===wt)i.up.set(0,1,0),i.lookAt(1,0,0),r.up.set(0,1,0),r.lookAt(-1,0,0),o.up.set(0,0,-1),o.lookAt(0,1,0),s.up.set(0,0,1),s.lookAt(0,-1,0),a.up.set(0,1,0),a.lookAt(0,0,1),c.up.set(0,1,0),c.lookAt(0,0,-1);else if(e===Pi)i.up.set(0,-1,0),i.lookAt(-1,0,0),r.up.set(0,-1,0),r.lookAt(1,0,0),o.up.set(0,0,1),o.lookAt(0,1,0),s.up.set(0,0,-1),s.lookAt(0,-1,0),a.up.set(0,-1,0),a.lookAt(0,0,1),c.up.set(0,-1,0),c.lookAt(0,0,-1);else throw new Error("THREE.CubeCamera.updateCoordinateSystem(): Invalid coordinate system: "+e);for(let l of t)this.add(l),l.updateMatrixWorld()}update(e,t){this.parent===null&&this.updateMatrixWorld();let{renderTarget:i,activeMipmapLevel:r}=this;this.coordinateSystem!==e.coordinateSystem&&(this.coordinateSystem=e.coordinateSystem,this.updateCoordinateSystem());let[o,s,a,c,l,f]=this.children,d=e.getRenderTarget(),h=e.getActiveCubeFace(),m=e.getActiveMipmapLevel(),x=e.xr.enabled;e.xr.enabled=!1;let v=i.texture.mipmapsAutoUpdate;i.texture.mipmapsAutoUpdate=!1;let p=!1;e.isWebGLRenderer===!0?p=e.state.buffers.depth.getReversed():p=e.reversedDepthBuffer,e.setRenderTarget(i,0,r),p&&e.autoClear===!1&&e.clearDepth(),e.render(t,o),e.setRenderTarget(i,1,r),p&&e.autoClear===!1&&e.clearDepth(),e.render(t,s),e.setRenderTarget(i,2,r),p&&e.autoClear===!1&&e.clearDepth(),e.render(t,a),e.setRenderTarget(i,3,r),p&&e.autoClear===!1&&e.clearDepth(),e.render(t,c),e.setRenderTarget(i,4,r),p&&e.autoClear===!1&&e.clearDepth(),e.render(t,l),i.texture.mipmapsAutoUpdate=v,e.setRenderTarget(i,5,r),p&&e.autoClear===!1&&e.clearDepth(),e.render(t,f),e.setRenderTarget(d,h,m),e.xr.enabled=x,i.texture.needsPMREMUpdate=!0}};var zs=class{constructor(e=1,t=0,i=0){this.radius=e,this.phi=t,this.theta=i}set(e,t,i){return this.radius=e,this.phi=t,this.theta=i,this}copy(e){return this.radius=e.radius,this.phi=e.phi,this.theta=e.theta,this}makeSafe(){return this.phi=Pe(this.phi,1e-6,Math.PI-1e-6),this}setFromVector3(e){return this.setFromCartesianCoords(e.x,e.y,e.z)}setFromCartesianCoords(e,t,i){return this.radius=Math.sqrt(e*e+t*t+i*i),this.radius===0?(this.theta=0,this.phi=0):(this.theta=Math.atan2(e,i),this.phi=Math.acos(Pe(t/this.radius,-1,1))),this}clone(){return new this.constructor().copy(this)}};var Hs=class extends yt{constructor(e,t=null){super(),this.object=e,this.domElement=t,this.enabled=!0,this.state=-1,this.keys={},this.mouseButtons={LEFT:null,MIDDLE:null,RIGHT:null},this.touches={ONE:null,TWO:null}}connect(e){this.domElement!==null&&this.disconnect(),this.domElement=e}disconnect(){}dispose(){}update(){}};function Na(n,e,t,i){let r=mp(i);switch(t){case Io:return n*e;case En:return n*e/r.components*r.byteLength;case Tn:return n*e/r.components*r.byteLength;case jt:return n*e*2/r.components*r.byteLength;case yn:return n*e*2/r.components*r.byteLength;case Uo:return n*e*3/r.components*r.byteLength;case Yt:return n*e*4/r.components*r.byteLength;case An:return n*e*4/r.components*r.byteLength;case bn:case Rn:return Math.floor((n+3)/4)*Math.floor((e+3)/4)*8;case wn:case Cn:return Math.floor((n+3)/4)*Math.floor((e+3)/4)*16;case yr:case br:return Math.max(n,16)*Math.max(e,8)/4;case Tr:case Ar:return Math.max(n,8)*Math.max(e,8)/2;case Rr:case wr:case Pr:case Lr:return Math.floor((n+3)/4)*Math.floor((e+3)/4)*8;case Cr:case sn:case Dr:return Math.floor((n+3)/4)*Math.floor((e+3)/4)*16;case Ir:return Math.floor((n+3)/4)*Math.floor((e+3)/4)*16;case Ur:return Math.floor((n+4)/5)*Math.floor((e+3)/4)*16;case Nr:return Math.floor((n+4)/5)*Math.floor((e+4)/5)*16;case Fr:return Math.floor((n+5)/6)*Math.floor((e+4)/5)*16;case Or:return Math.floor((n+5)/6)*Math.floor((e+5)/6)*16;case Br:return Math.floor((n+7)/8)*Math.floor((e+4)/5)*16;case Gr:return Math.floor((n+7)/8)*Math.floor((e+5)/6)*16;case zr:return Math.floor((n+7)/8)*Math.floor((e+7)/8)*16;case Hr:return Math.floor((n+9)/10)*Math.floor((e+4)/5)*16;case Vr:return Math.floor((n+9)/10)*Math.floor((e+5)/6)*16;case kr:return Math.floor((n+9)/10)*Math.floor((e+7)/8)*16;case Wr:return Math.floor((n+9)/10)*Math.floor((e+9)/10)*16;case Xr:return Math.floor((n+11)/12)*Math.floor((e+9)/10)*16;case qr:return Math.floor((n+11)/12)*Math.floor((e+11)/12)*16;case Yr:case Zr:case Kr:return Math.ceil(n/4)*Math.ceil(e/4)*16;case Jr:case $r:return Math.ceil(n/4)*Math.ceil(e/4)*8;case an:case Qr:return Math.ceil(n/4)*Math.ceil(e/4)*16}throw new Error(`Unable to determine texture byte length for ${t} format.`)}function mp(n){switch(n){case Tt:case Co:return{byteLength:1,components:1};case wi:case Po:case It:return{byteLength:2,components:1};case Mn:case vn:return{byteLength:2,components:4};case Dt:case Sn:case ut:return{byteLength:4,components:1};case Lo:case Do:return{byteLength:4,components:3}}throw new Error(`THREE.TextureUtils: Unknown texture type ${n}.`)}typeof __THREE_DEVTOOLS__<"u"&&__THREE_DEVTOOLS__.dispatchEvent(new CustomEvent("register",{detail:{revision:"187"}}));typeof window<"u"&&(window.__THREE__?pe("WARNING: Multiple instances of Three.js being imported."):window.__THREE__="187");function Pc(){let n=null,e=!1,t=null,i=null;function r(o,s){i=n.requestAnimationFrame(r),t(o,s)}return{start:function(){e!==!0&&t!==null&&n!==null&&(i=n.requestAnimationFrame(r),e=!0)},stop:function(){n!==null&&n.cancelAnimationFrame(i),e=!1},setAnimationLoop:function(o){t=o},setContext:function(o){n=o}}}function Lc(n){let e=new WeakMap;function t(a,c){let l=a.array,f=a.usage,d=l.byteLength,h=n.createBuffer();n.bindBuffer(c,h),n.bufferData(c,l,f),a.onUploadCallback();let m;if(l instanceof Float32Array)m=n.FLOAT;else if(typeof Float16Array<"u"&&l instanceof Float16Array)m=n.HALF_FLOAT;else if(l instanceof Uint16Array)a.isFloat16BufferAttribute?m=n.HALF_FLOAT:m=n.UNSIGNED_SHORT;else if(l instanceof Int16Array)m=n.SHORT;else if(l instanceof Uint32Array)m=n.UNSIGNED_INT;else if(l instanceof Int32Array)m=n.INT;else if(l instanceof Int8Array)m=n.BYTE;else if(l instanceof Uint8Array)m=n.UNSIGNED_BYTE;else if(l instanceof Uint8ClampedArray)m=n.UNSIGNED_BYTE;else throw new Error("THREE.WebGLAttributes: Unsupported buffer data format: "+l);return{buffer:h,type:m,bytesPerElement:l.BYTES_PER_ELEMENT,version:a.version,size:d}}function i(a,c,l){let f=c.array,d=c.updateRanges;if(n.bindBuffer(l,a),d.length===0)n.bufferSubData(l,0,f);else{d.sort((m,x)=>m.start-x.start);let h=0;for(let m=1;m<d.length;m++){let x=d[h],v=d[m];v.start<=x.start+x.count+1?x.count=Math.max(x.count,v.start+v.count-x.start):(++h,d[h]=v)}d.length=h+1;for(let m=0,x=d.length;m<x;m++){let v=d[m];n.bufferSubData(l,v.start*f.BYTES_PER_ELEMENT,f,v.start,v.count)}c.clearUpdateRanges()}c.onUploadCallback()}function r(a){return a.isInterleavedBufferAttribute&&(a=a.data),e.get(a)}function o(a){a.isInterleavedBufferAttribute&&(a=a.data);let c=e.get(a);c&&(n.deleteBuffer(c.buffer),e.delete(a))}function s(a,c){if(a.isInterleavedBufferAttribute&&(a=a.data),a.isGLBufferAttribute){let f=e.get(a);(!f||f.version<a.version)&&e.set(a,{buffer:a.buffer,type:a.type,bytesPerElement:a.elementSize,version:a.version});return}let l=e.get(a);if(l===void 0)e.set(a,t(a,c));else if(l.version<a.version){if(l.size!==a.array.byteLength)throw new Error("THREE.WebGLAttributes: The size of the buffer attribute's array buffer does not match the original size. Resizing buffer attributes is not supported.");i(l.buffer,a,c),l.version=a.version}}return{get:r,remove:o,update:s}}var Dc=`
#ifdef USE_ALPHAHASH
if ( diffuseColor.a<getAlphaHashThreshold( vPosition ) ) discard;
#endif
`;var Ic=`
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
`;var Uc=`
#ifdef USE_ALPHAMAP
diffuseColor.a*=texture2D( alphaMap,vAlphaMapUv ).g;
#endif
`;var Nc=`
#ifdef USE_ALPHAMAP
uniform sampler2D alphaMap;
#endif
`;var Fc=`
#ifdef USE_ALPHATEST
#ifdef ALPHA_TO_COVERAGE
diffuseColor.a=smoothstep( alphaTest,alphaTest+fwidth( diffuseColor.a ),diffuseColor.a );
if ( diffuseColor.a==.0 ) discard;
#else
if ( diffuseColor.a<alphaTest ) discard;
#endif
#endif
`;var Oc=`
#ifdef USE_ALPHATEST
uniform float alphaTest;
#endif
`;var Bc=`
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
`;var Gc=`
#ifdef USE_AOMAP
uniform sampler2D aoMap;
uniform float aoMapIntensity;
#endif
`;var zc=`
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
`;var Hc=`
#ifdef USE_BATCHING
mat4 batchingMatrix=getBatchingMatrix( getIndirectIndex( gl_DrawID ) );
#endif
`;var Vc=`
vec3 transformed=vec3( position );
#ifdef USE_ALPHAHASH
vPosition=vec3( position );
#endif
`;var kc=`
vec3 objectNormal=vec3( normal );
#ifdef USE_TANGENT
vec3 objectTangent=vec3( tangent.xyz );
#endif
`;var Wc=`
float G_BlinnPhong_Implicit(/*const in float dotNL,const in float dotNV*/){
return .25;
}
float D_BlinnPhong( const in float shininess,const in float dotNH ){
return RECIPROCAL_PI*( shininess*.5+1. )*pow( dotNH,shininess );
}
vec3 BRDF_BlinnPhong( const in vec3 lightDir,const in vec3 viewDir,const in vec3 normal,const in vec3 specularColor,const in float shininess ){
vec3 halfDir=normalize( lightDir+viewDir );
float dotNH=saturate( dot( normal,halfDir ) );
float dotVH=saturate( dot( viewDir,halfDir ) );
vec3 F=F_Schlick( specularColor,1.,dotVH );
float G=G_BlinnPhong_Implicit(/*dotNL,dotNV*/);
float D=D_BlinnPhong( shininess,dotNH );
return F*( G*D );
}
`;var Xc=`
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
`;var qc=`
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
`;var Yc=`
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
`;var Zc=`
#if NUM_CLIPPING_PLANES > 0
varying vec3 vClipPosition;
uniform vec4 clippingPlanes[ NUM_CLIPPING_PLANES ];
#endif
`;var Kc=`
#if NUM_CLIPPING_PLANES > 0
varying vec3 vClipPosition;
#endif
`;var Jc=`
#if NUM_CLIPPING_PLANES > 0
vClipPosition=- mvPosition.xyz;
#endif
`;var $c=`
#if defined( USE_COLOR ) || defined( USE_COLOR_ALPHA )
diffuseColor*=vColor;
#endif
`;var Qc=`
#if defined( USE_COLOR ) || defined( USE_COLOR_ALPHA )
varying vec4 vColor;
#endif
`;var jc=`
#if defined( USE_COLOR ) || defined( USE_COLOR_ALPHA ) || defined( USE_INSTANCING_COLOR ) || defined( USE_BATCHING_COLOR )
varying vec4 vColor;
#endif
`;var ef=`
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
`;var tf=`
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
`;var nf=`
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
`;var rf=`
#ifdef USE_DISPLACEMENTMAP
uniform sampler2D displacementMap;
uniform float displacementScale;
uniform float displacementBias;
#endif
`;var of=`
#ifdef USE_DISPLACEMENTMAP
transformed+=normalize( objectNormal )*( texture2D( displacementMap,vDisplacementMapUv ).x*displacementScale+displacementBias );
#endif
`;var sf=`
#ifdef USE_EMISSIVEMAP
vec4 emissiveColor=texture2D( emissiveMap,vEmissiveMapUv );
#ifdef DECODE_VIDEO_TEXTURE_EMISSIVE
emissiveColor=sRGBTransferEOTF( emissiveColor );
#endif
totalEmissiveRadiance*=emissiveColor.rgb;
#endif
`;var af=`
#ifdef USE_EMISSIVEMAP
uniform sampler2D emissiveMap;
#endif
`;var lf=`
gl_FragColor=linearToOutputTexel( gl_FragColor );
`;var cf=`
vec4 LinearTransferOETF( in vec4 value ){
return value;
}
vec4 sRGBTransferEOTF( in vec4 value ){
return vec4( mix( pow( value.rgb*.9478672986+vec3( .0521327014 ),vec3( 2.4 ) ),value.rgb*.0773993808,vec3( lessThanEqual( value.rgb,vec3( .04045 ) ) ) ),value.a );
}
vec4 sRGBTransferOETF( in vec4 value ){
return vec4( mix( pow( value.rgb,vec3( .41666 ) )*1.055 - vec3( .055 ),value.rgb*12.92,vec3( lessThanEqual( value.rgb,vec3( .0031308 ) ) ) ),value.a );
}
`;var ff=`
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
`;var uf=`
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
`;var hf=`
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
`;var df=`
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
`;var pf=`
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
`;var mf=`
#ifdef USE_FOG
vFogDepth=- mvPosition.z;
#endif
`;var gf=`
#ifdef USE_FOG
varying float vFogDepth;
#endif
`;var _f=`
#ifdef USE_FOG
#ifdef FOG_EXP2
float fogFactor=1. - exp( - fogDensity*fogDensity*vFogDepth*vFogDepth );
#else
float fogFactor=smoothstep( fogNear,fogFar,vFogDepth );
#endif
gl_FragColor.rgb=mix( gl_FragColor.rgb,fogColor,fogFactor );
#endif
`;var xf=`
#ifdef USE_FOG
uniform vec3 fogColor;
varying float vFogDepth;
#ifdef FOG_EXP2
uniform float fogDensity;
#else
uniform float fogNear;
uniform float fogFar;
#endif
#endif
`;var Sf=`
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
`;var Mf=`
#ifdef USE_LIGHTMAP
uniform sampler2D lightMap;
uniform float lightMapIntensity;
#endif
`;var vf=`
LambertMaterial material;
material.diffuseColor=diffuseColor.rgb;
material.specularStrength=specularStrength;
`;var Ef=`
varying vec3 vViewPosition;
struct LambertMaterial{
vec3 diffuseColor;
float specularStrength;
};
void RE_Direct_Lambert( const in IncidentLight directLight,const in vec3 geometryPosition,const in vec3 geometryNormal,const in vec3 geometryViewDir,const in vec3 geometryClearcoatNormal,const in LambertMaterial material,inout ReflectedLight reflectedLight ){
float dotNL=saturate( dot( geometryNormal,directLight.direction ) );
vec3 irradiance=dotNL*directLight.color;
reflectedLight.directDiffuse+=irradiance*BRDF_Lambert( material.diffuseColor );
}
void RE_IndirectDiffuse_Lambert( const in vec3 irradiance,const in vec3 geometryPosition,const in vec3 geometryNormal,const in vec3 geometryViewDir,const in vec3 geometryClearcoatNormal,const in LambertMaterial material,inout ReflectedLight reflectedLight ){
reflectedLight.indirectDiffuse+=irradiance*BRDF_Lambert( material.diffuseColor );
}
#define RE_Direct				RE_Direct_Lambert
#define RE_IndirectDiffuse		RE_IndirectDiffuse_Lambert
`;var Tf=`
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
`;var yf=`
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
`;var Af=`
ToonMaterial material;
material.diffuseColor=diffuseColor.rgb;
`;var bf=`
varying vec3 vViewPosition;
struct ToonMaterial{
vec3 diffuseColor;
};
void RE_Direct_Toon( const in IncidentLight directLight,const in vec3 geometryPosition,const in vec3 geometryNormal,const in vec3 geometryViewDir,const in vec3 geometryClearcoatNormal,const in ToonMaterial material,inout ReflectedLight reflectedLight ){
vec3 irradiance=getGradientIrradiance( geometryNormal,directLight.direction )*directLight.color;
reflectedLight.directDiffuse+=irradiance*BRDF_Lambert( material.diffuseColor );
}
void RE_IndirectDiffuse_Toon( const in vec3 irradiance,const in vec3 geometryPosition,const in vec3 geometryNormal,const in vec3 geometryViewDir,const in vec3 geometryClearcoatNormal,const in ToonMaterial material,inout ReflectedLight reflectedLight ){
reflectedLight.indirectDiffuse+=irradiance*BRDF_Lambert( material.diffuseColor );
}
#define RE_Direct				RE_Direct_Toon
#define RE_IndirectDiffuse		RE_IndirectDiffuse_Toon
`;var Rf=`
BlinnPhongMaterial material;
material.diffuseColor=diffuseColor.rgb;
material.specularColor=specular;
material.specularShininess=shininess;
material.specularStrength=specularStrength;
`;var wf=`
varying vec3 vViewPosition;
struct BlinnPhongMaterial{
vec3 diffuseColor;
vec3 specularColor;
float specularShininess;
float specularStrength;
};
void RE_Direct_BlinnPhong( const in IncidentLight directLight,const in vec3 geometryPosition,const in vec3 geometryNormal,const in vec3 geometryViewDir,const in vec3 geometryClearcoatNormal,const in BlinnPhongMaterial material,inout ReflectedLight reflectedLight ){
float dotNL=saturate( dot( geometryNormal,directLight.direction ) );
vec3 irradiance=dotNL*directLight.color;
reflectedLight.directDiffuse+=irradiance*BRDF_Lambert( material.diffuseColor );
reflectedLight.directSpecular+=irradiance*BRDF_BlinnPhong( directLight.direction,geometryViewDir,geometryNormal,material.specularColor,material.specularShininess )*material.specularStrength;
}
void RE_IndirectDiffuse_BlinnPhong( const in vec3 irradiance,const in vec3 geometryPosition,const in vec3 geometryNormal,const in vec3 geometryViewDir,const in vec3 geometryClearcoatNormal,const in BlinnPhongMaterial material,inout ReflectedLight reflectedLight ){
reflectedLight.indirectDiffuse+=irradiance*BRDF_Lambert( material.diffuseColor );
}
#define RE_Direct				RE_Direct_BlinnPhong
#define RE_IndirectDiffuse		RE_IndirectDiffuse_BlinnPhong
`;var Cf=`
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
`;var Pf=`
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
`;var Lf=`
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
`;var Df=`
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
`;var If=`
#if defined( RE_IndirectDiffuse )
#if defined( LAMBERT ) || defined( PHONG )
irradiance+=iblIrradiance;
#endif
RE_IndirectDiffuse( irradiance,geometryPosition,geometryNormal,geometryViewDir,geometryClearcoatNormal,material,reflectedLight );
#endif
#if defined( RE_IndirectSpecular )
RE_IndirectSpecular( radiance,iblIrradiance,clearcoatRadiance,geometryPosition,geometryNormal,geometryViewDir,geometryClearcoatNormal,material,reflectedLight );
#endif
`;var Uf=`
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
`;var Nf=`
#if defined( USE_LOGARITHMIC_DEPTH_BUFFER )
gl_FragDepth=vIsPerspective==.0?gl_FragCoord.z:log2( vFragDepth )*logDepthBufFC*.5;
#endif
`;var Ff=`
#if defined( USE_LOGARITHMIC_DEPTH_BUFFER )
uniform float logDepthBufFC;
varying float vFragDepth;
varying float vIsPerspective;
#endif
`;var Of=`
#ifdef USE_LOGARITHMIC_DEPTH_BUFFER
varying float vFragDepth;
varying float vIsPerspective;
#endif
`;var Bf=`
#ifdef USE_LOGARITHMIC_DEPTH_BUFFER
vFragDepth=1.+gl_Position.w;
vIsPerspective=float( isPerspectiveMatrix( projectionMatrix ) );
#endif
`;var Gf=`
#ifdef USE_MAP
vec4 sampledDiffuseColor=texture2D( map,vMapUv );
#ifdef DECODE_VIDEO_TEXTURE
sampledDiffuseColor=sRGBTransferEOTF( sampledDiffuseColor );
#endif
diffuseColor*=sampledDiffuseColor;
#endif
`;var zf=`
#ifdef USE_MAP
uniform sampler2D map;
#endif
`;var Hf=`
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
`;var Vf=`
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
`;var kf=`
float metalnessFactor=metalness;
#ifdef USE_METALNESSMAP
vec4 texelMetalness=texture2D( metalnessMap,vMetalnessMapUv );
metalnessFactor*=texelMetalness.b;
#endif
`;var Wf=`
#ifdef USE_METALNESSMAP
uniform sampler2D metalnessMap;
#endif
`;var Xf=`
#ifdef USE_INSTANCING_MORPH
float morphTargetInfluences[ MORPHTARGETS_COUNT ];
float morphTargetBaseInfluence=texelFetch( morphTexture,ivec2( 0,gl_InstanceID ),0 ).r;
for ( int i=0;i<MORPHTARGETS_COUNT;i++){
morphTargetInfluences[i]= texelFetch( morphTexture,ivec2( i+1,gl_InstanceID ),0 ).r;
}
#endif
`;var qf=`
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
`;var Yf=`
#ifdef USE_MORPHNORMALS
objectNormal*=morphTargetBaseInfluence;
for ( int i=0;i<MORPHTARGETS_COUNT;i++){
if ( morphTargetInfluences[ i ] !=.0 ) objectNormal+=getMorph( gl_VertexID,i,1 ).xyz*morphTargetInfluences[ i ];
}
#endif
`;var Zf=`
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
`;var Kf=`
#ifdef USE_MORPHTARGETS
transformed*=morphTargetBaseInfluence;
for ( int i=0;i<MORPHTARGETS_COUNT;i++){
if ( morphTargetInfluences[ i ] !=.0 ) transformed+=getMorph( gl_VertexID,i,0 ).xyz*morphTargetInfluences[ i ];
}
#endif
`;var Jf=`
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
`;var $f=`
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
`;var Qf=`
#ifndef FLAT_SHADED
varying vec3 vNormal;
#ifdef USE_TANGENT
varying vec3 vTangent;
varying vec3 vBitangent;
#endif
#endif
`;var jf=`
#ifndef FLAT_SHADED
varying vec3 vNormal;
#ifdef USE_TANGENT
varying vec3 vTangent;
varying vec3 vBitangent;
#endif
#endif
`;var eu=`
#ifndef FLAT_SHADED
vNormal=normalize( transformedNormal );
#ifdef USE_TANGENT
vTangent=normalize( transformedTangent );
vBitangent=normalize( cross( vNormal,vTangent )*tangent.w );
#ifdef FLIP_SIDED
vBitangent=- vBitangent;
#endif
#endif
#endif
`;var tu=`
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
`;var iu=`
#ifdef USE_CLEARCOAT
vec3 clearcoatNormal=nonPerturbedNormal;
#endif
`;var nu=`
#ifdef USE_CLEARCOAT_NORMALMAP
vec3 clearcoatMapN=texture2D( clearcoatNormalMap,vClearcoatNormalMapUv ).xyz*2. - 1.;
clearcoatMapN.xy*=clearcoatNormalScale;
clearcoatNormal=normalize( tbn2*clearcoatMapN );
#endif
`;var ru=`
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
`;var ou=`
#ifdef USE_IRIDESCENCEMAP
uniform sampler2D iridescenceMap;
#endif
#ifdef USE_IRIDESCENCE_THICKNESSMAP
uniform sampler2D iridescenceThicknessMap;
#endif
`;var su=`
#ifdef OPAQUE
diffuseColor.a=1.;
#endif
#ifdef USE_TRANSMISSION
diffuseColor.a*=material.transmissionAlpha;
#endif
gl_FragColor=vec4( outgoingLight,diffuseColor.a );
`;var au=`
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
`;var lu=`
#ifdef PREMULTIPLIED_ALPHA
gl_FragColor.rgb*=gl_FragColor.a;
#endif
`;var cu=`
vec4 mvPosition=vec4( transformed,1. );
#ifdef USE_BATCHING
mvPosition=batchingMatrix*mvPosition;
#endif
#ifdef USE_INSTANCING
mvPosition=instanceMatrix*mvPosition;
#endif
mvPosition=modelViewMatrix*mvPosition;
gl_Position=projectionMatrix*mvPosition;
`;var fu=`
#ifdef DITHERING
gl_FragColor.rgb=dithering( gl_FragColor.rgb );
#endif
`;var uu=`
#ifdef DITHERING
vec3 dithering( vec3 color ){
float grid_position=rand( gl_FragCoord.xy );
vec3 dither_shift_RGB=vec3( .25/255.,-.25/255.,.25/255. );
dither_shift_RGB=mix( 2.*dither_shift_RGB,-2.*dither_shift_RGB,grid_position );
return color+dither_shift_RGB;
}
#endif
`;var hu=`
float roughnessFactor=roughness;
#ifdef USE_ROUGHNESSMAP
vec4 texelRoughness=texture2D( roughnessMap,vRoughnessMapUv );
roughnessFactor*=texelRoughness.g;
#endif
`;var du=`
#ifdef USE_ROUGHNESSMAP
uniform sampler2D roughnessMap;
#endif
`;var pu=`
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
`;var mu=`
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
`;var gu=`
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
`;var _u=`
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
`;var xu=`
#ifdef USE_SKINNING
mat4 boneMatX=getBoneMatrix( skinIndex.x );
mat4 boneMatY=getBoneMatrix( skinIndex.y );
mat4 boneMatZ=getBoneMatrix( skinIndex.z );
mat4 boneMatW=getBoneMatrix( skinIndex.w );
#endif
`;var Su=`
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
`;var Mu=`
#ifdef USE_SKINNING
vec4 skinVertex=bindMatrix*vec4( transformed,1. );
vec4 skinned=vec4( .0 );
skinned+=boneMatX*skinVertex*skinWeight.x;
skinned+=boneMatY*skinVertex*skinWeight.y;
skinned+=boneMatZ*skinVertex*skinWeight.z;
skinned+=boneMatW*skinVertex*skinWeight.w;
transformed=( bindMatrixInverse*skinned ).xyz;
#endif
`;var vu=`
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
`;var Eu=`
float specularStrength;
#ifdef USE_SPECULARMAP
vec4 texelSpecular=texture2D( specularMap,vSpecularMapUv );
specularStrength=texelSpecular.r;
#else
specularStrength=1.;
#endif
`;var Tu=`
#ifdef USE_SPECULARMAP
uniform sampler2D specularMap;
#endif
`;var yu=`
#if defined( TONE_MAPPING )
gl_FragColor.rgb=toneMapping( gl_FragColor.rgb );
#endif
`;var Au=`
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
`;var bu=`
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
`;var Ru=`
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
`;var wu=`
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
`;var Cu=`
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
`;var Pu=`
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
`;var Lu=`
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
`;var Du=`
varying vec2 vUv;
uniform mat3 uvTransform;
void main(){
vUv=( uvTransform*vec3( uv,1 ) ).xy;
gl_Position=vec4( position.xy,1.,1. );
}
`,Iu=`
uniform sampler2D t2D;
uniform float backgroundIntensity;
varying vec2 vUv;
void main(){
vec4 texColor=texture2D( t2D,vUv );
#ifdef DECODE_VIDEO_TEXTURE
texColor=vec4( mix( pow( texColor.rgb*.9478672986+vec3( .0521327014 ),vec3( 2.4 ) ),texColor.rgb*.0773993808,vec3( lessThanEqual( texColor.rgb,vec3( .04045 ) ) ) ),texColor.w );
#endif
texColor.rgb*=backgroundIntensity;
gl_FragColor=texColor;
#include <tonemapping_fragment>
#include <colorspace_fragment>
}
`;var Uu=`
varying vec3 vWorldDirection;
#include <common>
void main(){
vWorldDirection=transformDirection( position,modelMatrix );
#include <begin_vertex>
#include <project_vertex>
gl_Position.z=gl_Position.w;
}
`,Nu=`
uniform float backgroundBlurriness;
uniform float backgroundIntensity;
uniform mat3 backgroundRotation;
varying vec3 vWorldDirection;
#include <envmap_common_pars_fragment>
void main(){
#ifdef ENVMAP_TYPE_PMREM
vec4 texColor=textureLod( envMap,backgroundRotation*vWorldDirection,roughnessToMip( backgroundBlurriness ) );
#else
vec4 texColor=textureCube( envMap,backgroundRotation*vWorldDirection );
#endif
texColor.rgb*=backgroundIntensity;
gl_FragColor=texColor;
#include <tonemapping_fragment>
#include <colorspace_fragment>
}
`;var Fu=`
varying vec3 vWorldDirection;
#include <common>
void main(){
vWorldDirection=transformDirection( position,modelMatrix );
#include <begin_vertex>
#include <project_vertex>
gl_Position.z=gl_Position.w;
}
`,Ou=`
uniform samplerCube tCube;
uniform float tFlip;
uniform float opacity;
varying vec3 vWorldDirection;
void main(){
vec4 texColor=textureCube( tCube,vec3( tFlip*vWorldDirection.x,vWorldDirection.yz ) );
gl_FragColor=texColor;
gl_FragColor.a*=opacity;
#include <tonemapping_fragment>
#include <colorspace_fragment>
}
`;var Bu=`
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
varying vec2 vHighPrecisionZW;
void main(){
#include <uv_vertex>
#include <batching_vertex>
#include <skinbase_vertex>
#include <morphinstance_vertex>
#ifdef USE_DISPLACEMENTMAP
#include <beginnormal_vertex>
#include <morphnormal_vertex>
#include <skinnormal_vertex>
#endif
#include <begin_vertex>
#include <morphtarget_vertex>
#include <skinning_vertex>
#include <displacementmap_vertex>
#include <project_vertex>
#include <logdepthbuf_vertex>
#include <clipping_planes_vertex>
vHighPrecisionZW=gl_Position.zw;
}
`,Gu=`
#if DEPTH_PACKING == 3200
uniform float opacity;
#endif
#include <common>
#include <packing>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
varying vec2 vHighPrecisionZW;
void main(){
vec4 diffuseColor=vec4( 1. );
#include <clipping_planes_fragment>
#if DEPTH_PACKING == 3200
diffuseColor.a=opacity;
#endif
#include <map_fragment>
#include <alphamap_fragment>
#include <alphatest_fragment>
#include <alphahash_fragment>
#include <logdepthbuf_fragment>
#ifdef USE_REVERSED_DEPTH_BUFFER
float fragCoordZ=vHighPrecisionZW[ 0 ]/vHighPrecisionZW[ 1 ];
#else
float fragCoordZ=.5*vHighPrecisionZW[ 0 ]/vHighPrecisionZW[ 1 ]+.5;
#endif
#if DEPTH_PACKING == 3200
gl_FragColor=vec4( vec3( 1. - fragCoordZ ),opacity );
#elif DEPTH_PACKING == 3201
gl_FragColor=packDepthToRGBA( fragCoordZ );
#elif DEPTH_PACKING == 3202
gl_FragColor=vec4( packDepthToRGB( fragCoordZ ),1. );
#elif DEPTH_PACKING == 3203
gl_FragColor=vec4( packDepthToRG( fragCoordZ ),.0,1. );
#endif
}
`;var zu=`
#define DISTANCE
varying vec3 vWorldPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <clipping_planes_pars_vertex>
void main(){
#include <uv_vertex>
#include <batching_vertex>
#include <skinbase_vertex>
#include <morphinstance_vertex>
#ifdef USE_DISPLACEMENTMAP
#include <beginnormal_vertex>
#include <morphnormal_vertex>
#include <skinnormal_vertex>
#endif
#include <begin_vertex>
#include <morphtarget_vertex>
#include <skinning_vertex>
#include <displacementmap_vertex>
#include <project_vertex>
#include <worldpos_vertex>
#include <clipping_planes_vertex>
vWorldPosition=worldPosition.xyz;
}
`,Hu=`
#define DISTANCE
uniform vec3 referencePosition;
uniform float nearDistance;
uniform float farDistance;
varying vec3 vWorldPosition;
#include <common>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <clipping_planes_pars_fragment>
void main(){
vec4 diffuseColor=vec4( 1. );
#include <clipping_planes_fragment>
#include <map_fragment>
#include <alphamap_fragment>
#include <alphatest_fragment>
#include <alphahash_fragment>
float dist=length( vWorldPosition - referencePosition );
dist=( dist - nearDistance )/( farDistance - nearDistance );
dist=saturate( dist );
gl_FragColor=vec4( dist,.0,.0,1. );
}
`;var Vu=`
varying vec3 vWorldDirection;
#include <common>
void main(){
vWorldDirection=transformDirection( position,modelMatrix );
#include <begin_vertex>
#include <project_vertex>
}
`,ku=`
uniform sampler2D tEquirect;
varying vec3 vWorldDirection;
#include <common>
void main(){
vec3 direction=normalize( vWorldDirection );
vec2 sampleUV=equirectUv( direction );
gl_FragColor=texture2D( tEquirect,sampleUV );
#include <tonemapping_fragment>
#include <colorspace_fragment>
}
`;var Wu=`
uniform float scale;
attribute float lineDistance;
varying float vLineDistance;
#include <common>
#include <uv_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <morphtarget_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main(){
vLineDistance=scale*lineDistance;
#include <uv_vertex>
#include <color_vertex>
#include <morphinstance_vertex>
#include <morphcolor_vertex>
#include <begin_vertex>
#include <morphtarget_vertex>
#include <project_vertex>
#include <logdepthbuf_vertex>
#include <clipping_planes_vertex>
#include <fog_vertex>
}
`,Xu=`
uniform vec3 diffuse;
uniform float opacity;
uniform float dashSize;
uniform float totalSize;
varying float vLineDistance;
#include <common>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <fog_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main(){
vec4 diffuseColor=vec4( diffuse,opacity );
#include <clipping_planes_fragment>
if ( mod( vLineDistance,totalSize )>dashSize ){
discard;
}
vec3 outgoingLight=vec3( .0 );
#include <logdepthbuf_fragment>
#include <map_fragment>
#include <color_fragment>
outgoingLight=diffuseColor.rgb;
#include <opaque_fragment>
#include <tonemapping_fragment>
#include <colorspace_fragment>
#include <fog_fragment>
#include <premultiplied_alpha_fragment>
}
`;var qu=`
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <envmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main(){
#include <uv_vertex>
#include <color_vertex>
#include <morphinstance_vertex>
#include <morphcolor_vertex>
#include <batching_vertex>
#if defined ( USE_ENVMAP ) || defined ( USE_SKINNING )
#include <beginnormal_vertex>
#include <morphnormal_vertex>
#include <skinbase_vertex>
#include <skinnormal_vertex>
#include <defaultnormal_vertex>
#endif
#include <begin_vertex>
#include <morphtarget_vertex>
#include <skinning_vertex>
#include <project_vertex>
#include <logdepthbuf_vertex>
#include <clipping_planes_vertex>
#include <worldpos_vertex>
#include <envmap_vertex>
#include <fog_vertex>
}
`,Yu=`
uniform vec3 diffuse;
uniform float opacity;
#ifndef FLAT_SHADED
varying vec3 vNormal;
#endif
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <envmap_common_pars_fragment>
#include <envmap_pars_fragment>
#include <fog_pars_fragment>
#include <specularmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main(){
vec4 diffuseColor=vec4( diffuse,opacity );
#include <clipping_planes_fragment>
#include <logdepthbuf_fragment>
#include <map_fragment>
#include <color_fragment>
#include <alphamap_fragment>
#include <alphatest_fragment>
#include <alphahash_fragment>
#include <specularmap_fragment>
ReflectedLight reflectedLight=ReflectedLight( vec3( .0 ),vec3( .0 ),vec3( .0 ),vec3( .0 ) );
#ifdef USE_LIGHTMAP
vec4 lightMapTexel=texture2D( lightMap,vLightMapUv );
reflectedLight.indirectDiffuse+=lightMapTexel.rgb*lightMapIntensity*RECIPROCAL_PI;
#else
reflectedLight.indirectDiffuse+=vec3( 1. );
#endif
#include <aomap_fragment>
reflectedLight.indirectDiffuse*=diffuseColor.rgb;
vec3 outgoingLight=reflectedLight.indirectDiffuse;
#include <envmap_fragment>
#include <opaque_fragment>
#include <tonemapping_fragment>
#include <colorspace_fragment>
#include <fog_fragment>
#include <premultiplied_alpha_fragment>
#include <dithering_fragment>
}
`;var Zu=`
#define LAMBERT
varying vec3 vViewPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <envmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <shadowmap_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main(){
#include <uv_vertex>
#include <color_vertex>
#include <morphinstance_vertex>
#include <morphcolor_vertex>
#include <batching_vertex>
#include <beginnormal_vertex>
#include <morphnormal_vertex>
#include <skinbase_vertex>
#include <skinnormal_vertex>
#include <defaultnormal_vertex>
#include <normal_vertex>
#include <begin_vertex>
#include <morphtarget_vertex>
#include <skinning_vertex>
#include <displacementmap_vertex>
#include <project_vertex>
#include <logdepthbuf_vertex>
#include <clipping_planes_vertex>
vViewPosition=- mvPosition.xyz;
#include <worldpos_vertex>
#include <envmap_vertex>
#include <shadowmap_vertex>
#include <fog_vertex>
}
`,Ku=`
#define LAMBERT
uniform vec3 diffuse;
uniform vec3 emissive;
uniform float opacity;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <emissivemap_pars_fragment>
#include <envmap_common_pars_fragment>
#include <envmap_pars_fragment>
#include <envmap_physical_pars_fragment>
#include <fog_pars_fragment>
#include <bsdfs>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <lights_lambert_pars_fragment>
#include <shadowmap_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <specularmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main(){
vec4 diffuseColor=vec4( diffuse,opacity );
#include <clipping_planes_fragment>
ReflectedLight reflectedLight=ReflectedLight( vec3( .0 ),vec3( .0 ),vec3( .0 ),vec3( .0 ) );
vec3 totalEmissiveRadiance=emissive;
#include <logdepthbuf_fragment>
#include <map_fragment>
#include <color_fragment>
#include <alphamap_fragment>
#include <alphatest_fragment>
#include <alphahash_fragment>
#include <specularmap_fragment>
#include <normal_fragment_begin>
#include <normal_fragment_maps>
#include <emissivemap_fragment>
#include <lights_lambert_fragment>
#include <lights_fragment_begin>
#include <lights_fragment_maps>
#include <lights_fragment_end>
#include <aomap_fragment>
vec3 outgoingLight=reflectedLight.directDiffuse+reflectedLight.indirectDiffuse+totalEmissiveRadiance;
#include <envmap_fragment>
#include <opaque_fragment>
#include <tonemapping_fragment>
#include <colorspace_fragment>
#include <fog_fragment>
#include <premultiplied_alpha_fragment>
#include <dithering_fragment>
}
`;var Ju=`
#define MATCAP
varying vec3 vViewPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <color_pars_vertex>
#include <displacementmap_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main(){
#include <uv_vertex>
#include <color_vertex>
#include <morphinstance_vertex>
#include <morphcolor_vertex>
#include <batching_vertex>
#include <beginnormal_vertex>
#include <morphnormal_vertex>
#include <skinbase_vertex>
#include <skinnormal_vertex>
#include <defaultnormal_vertex>
#include <normal_vertex>
#include <begin_vertex>
#include <morphtarget_vertex>
#include <skinning_vertex>
#include <displacementmap_vertex>
#include <project_vertex>
#include <logdepthbuf_vertex>
#include <clipping_planes_vertex>
#include <fog_vertex>
vViewPosition=- mvPosition.xyz;
}
`,$u=`
#define MATCAP
uniform vec3 diffuse;
uniform float opacity;
uniform sampler2D matcap;
varying vec3 vViewPosition;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <fog_pars_fragment>
#include <normal_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main(){
vec4 diffuseColor=vec4( diffuse,opacity );
#include <clipping_planes_fragment>
#include <logdepthbuf_fragment>
#include <map_fragment>
#include <color_fragment>
#include <alphamap_fragment>
#include <alphatest_fragment>
#include <alphahash_fragment>
#include <normal_fragment_begin>
#include <normal_fragment_maps>
vec3 viewDir=normalize( vViewPosition );
vec3 x=normalize( vec3( viewDir.z,.0,- viewDir.x ) );
vec3 y=cross( viewDir,x );
vec2 uv=vec2( dot( x,normal ),dot( y,normal ) )*.495+.5;
#ifdef USE_MATCAP
vec4 matcapColor=texture2D( matcap,uv );
#else
vec4 matcapColor=vec4( vec3( mix( .2,.8,uv.y ) ),1. );
#endif
vec3 outgoingLight=diffuseColor.rgb*matcapColor.rgb;
#include <opaque_fragment>
#include <tonemapping_fragment>
#include <colorspace_fragment>
#include <fog_fragment>
#include <premultiplied_alpha_fragment>
#include <dithering_fragment>
}
`;var Qu=`
#define NORMAL
#if defined( FLAT_SHADED ) || defined( USE_BUMPMAP ) || defined( USE_NORMALMAP_TANGENTSPACE )
varying vec3 vViewPosition;
#endif
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main(){
#include <uv_vertex>
#include <batching_vertex>
#include <beginnormal_vertex>
#include <morphinstance_vertex>
#include <morphnormal_vertex>
#include <skinbase_vertex>
#include <skinnormal_vertex>
#include <defaultnormal_vertex>
#include <normal_vertex>
#include <begin_vertex>
#include <morphtarget_vertex>
#include <skinning_vertex>
#include <displacementmap_vertex>
#include <project_vertex>
#include <logdepthbuf_vertex>
#include <clipping_planes_vertex>
#if defined( FLAT_SHADED ) || defined( USE_BUMPMAP ) || defined( USE_NORMALMAP_TANGENTSPACE )
vViewPosition=- mvPosition.xyz;
#endif
}
`,ju=`
#define NORMAL
uniform float opacity;
#if defined( FLAT_SHADED ) || defined( USE_BUMPMAP ) || defined( USE_NORMALMAP_TANGENTSPACE )
varying vec3 vViewPosition;
#endif
#include <uv_pars_fragment>
#include <normal_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main(){
vec4 diffuseColor=vec4( .0,.0,.0,opacity );
#include <clipping_planes_fragment>
#include <logdepthbuf_fragment>
#include <normal_fragment_begin>
#include <normal_fragment_maps>
gl_FragColor=vec4( normalize( normal )*.5+.5,diffuseColor.a );
#ifdef OPAQUE
gl_FragColor.a=1.;
#endif
}
`;var eh=`
#define PHONG
varying vec3 vViewPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <envmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <shadowmap_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main(){
#include <uv_vertex>
#include <color_vertex>
#include <morphcolor_vertex>
#include <batching_vertex>
#include <beginnormal_vertex>
#include <morphinstance_vertex>
#include <morphnormal_vertex>
#include <skinbase_vertex>
#include <skinnormal_vertex>
#include <defaultnormal_vertex>
#include <normal_vertex>
#include <begin_vertex>
#include <morphtarget_vertex>
#include <skinning_vertex>
#include <displacementmap_vertex>
#include <project_vertex>
#include <logdepthbuf_vertex>
#include <clipping_planes_vertex>
vViewPosition=- mvPosition.xyz;
#include <worldpos_vertex>
#include <envmap_vertex>
#include <shadowmap_vertex>
#include <fog_vertex>
}
`,th=`
#define PHONG
uniform vec3 diffuse;
uniform vec3 emissive;
uniform vec3 specular;
uniform float shininess;
uniform float opacity;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <emissivemap_pars_fragment>
#include <envmap_common_pars_fragment>
#include <envmap_pars_fragment>
#include <envmap_physical_pars_fragment>
#include <fog_pars_fragment>
#include <bsdfs>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <lights_phong_pars_fragment>
#include <shadowmap_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <specularmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main(){
vec4 diffuseColor=vec4( diffuse,opacity );
#include <clipping_planes_fragment>
ReflectedLight reflectedLight=ReflectedLight( vec3( .0 ),vec3( .0 ),vec3( .0 ),vec3( .0 ) );
vec3 totalEmissiveRadiance=emissive;
#include <logdepthbuf_fragment>
#include <map_fragment>
#include <color_fragment>
#include <alphamap_fragment>
#include <alphatest_fragment>
#include <alphahash_fragment>
#include <specularmap_fragment>
#include <normal_fragment_begin>
#include <normal_fragment_maps>
#include <emissivemap_fragment>
#include <lights_phong_fragment>
#include <lights_fragment_begin>
#include <lights_fragment_maps>
#include <lights_fragment_end>
#include <aomap_fragment>
vec3 outgoingLight=reflectedLight.directDiffuse+reflectedLight.indirectDiffuse+reflectedLight.directSpecular+reflectedLight.indirectSpecular+totalEmissiveRadiance;
#include <envmap_fragment>
#include <opaque_fragment>
#include <tonemapping_fragment>
#include <colorspace_fragment>
#include <fog_fragment>
#include <premultiplied_alpha_fragment>
#include <dithering_fragment>
}
`;var ih=`
#define STANDARD
varying vec3 vViewPosition;
#ifdef USE_TRANSMISSION
varying vec3 vWorldPosition;
#endif
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <shadowmap_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main(){
#include <uv_vertex>
#include <color_vertex>
#include <morphinstance_vertex>
#include <morphcolor_vertex>
#include <batching_vertex>
#include <beginnormal_vertex>
#include <morphnormal_vertex>
#include <skinbase_vertex>
#include <skinnormal_vertex>
#include <defaultnormal_vertex>
#include <normal_vertex>
#include <begin_vertex>
#include <morphtarget_vertex>
#include <skinning_vertex>
#include <displacementmap_vertex>
#include <project_vertex>
#include <logdepthbuf_vertex>
#include <clipping_planes_vertex>
vViewPosition=- mvPosition.xyz;
#include <worldpos_vertex>
#include <shadowmap_vertex>
#include <fog_vertex>
#ifdef USE_TRANSMISSION
vWorldPosition=worldPosition.xyz;
#endif
}
`,nh=`
#define STANDARD
#ifdef PHYSICAL
#define IOR
#define USE_SPECULAR
#endif
uniform vec3 diffuse;
uniform vec3 emissive;
uniform float roughness;
uniform float metalness;
uniform float opacity;
#ifdef IOR
uniform float ior;
#endif
#ifdef USE_SPECULAR
uniform float specularIntensity;
uniform vec3 specularColor;
#ifdef USE_SPECULAR_COLORMAP
uniform sampler2D specularColorMap;
#endif
#ifdef USE_SPECULAR_INTENSITYMAP
uniform sampler2D specularIntensityMap;
#endif
#endif
#ifdef USE_CLEARCOAT
uniform float clearcoat;
uniform float clearcoatRoughness;
#endif
#ifdef USE_DIFFUSE_ROUGHNESS
uniform float diffuseRoughness;
#ifdef USE_DIFFUSE_ROUGHNESSMAP
uniform sampler2D diffuseRoughnessMap;
#endif
#endif
#ifdef USE_DISPERSION
uniform float dispersion;
#endif
#ifdef USE_RETROREFLECTION
uniform float retroreflectivity;
#endif
#ifdef USE_IRIDESCENCE
uniform float iridescence;
uniform float iridescenceIOR;
uniform float iridescenceThicknessMinimum;
uniform float iridescenceThicknessMaximum;
#endif
#ifdef USE_SHEEN
uniform vec3 sheenColor;
uniform float sheenRoughness;
#ifdef USE_SHEEN_COLORMAP
uniform sampler2D sheenColorMap;
#endif
#ifdef USE_SHEEN_ROUGHNESSMAP
uniform sampler2D sheenRoughnessMap;
#endif
#endif
#ifdef USE_ANISOTROPY
uniform vec2 anisotropyVector;
#ifdef USE_ANISOTROPYMAP
uniform sampler2D anisotropyMap;
#endif
#endif
varying vec3 vViewPosition;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <emissivemap_pars_fragment>
#include <iridescence_fragment>
#include <envmap_common_pars_fragment>
#include <envmap_physical_pars_fragment>
#include <fog_pars_fragment>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <lights_physical_pars_fragment>
#include <transmission_pars_fragment>
#include <shadowmap_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <clearcoat_pars_fragment>
#include <iridescence_pars_fragment>
#include <roughnessmap_pars_fragment>
#include <metalnessmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main(){
vec4 diffuseColor=vec4( diffuse,opacity );
#include <clipping_planes_fragment>
ReflectedLight reflectedLight=ReflectedLight( vec3( .0 ),vec3( .0 ),vec3( .0 ),vec3( .0 ) );
vec3 totalEmissiveRadiance=emissive;
#include <logdepthbuf_fragment>
#include <map_fragment>
#include <color_fragment>
#include <alphamap_fragment>
#include <alphatest_fragment>
#include <alphahash_fragment>
#include <roughnessmap_fragment>
#include <metalnessmap_fragment>
#include <normal_fragment_begin>
#include <normal_fragment_maps>
#include <clearcoat_normal_fragment_begin>
#include <clearcoat_normal_fragment_maps>
#include <emissivemap_fragment>
#include <lights_physical_fragment>
#include <lights_fragment_begin>
#include <lights_fragment_maps>
#include <lights_fragment_end>
#include <aomap_fragment>
vec3 totalDiffuse=reflectedLight.directDiffuse+reflectedLight.indirectDiffuse;
vec3 totalSpecular=reflectedLight.directSpecular+reflectedLight.indirectSpecular;
#include <transmission_fragment>
vec3 outgoingLight=totalDiffuse+totalSpecular+totalEmissiveRadiance;
#ifdef USE_SHEEN
outgoingLight=outgoingLight+sheenSpecularDirect+sheenSpecularIndirect;
#endif
#ifdef USE_CLEARCOAT
float dotNVcc=saturate( dot( geometryClearcoatNormal,geometryViewDir ) );
vec3 Fcc=F_Schlick( material.clearcoatF0,material.clearcoatF90,dotNVcc );
outgoingLight=outgoingLight*( 1. - material.clearcoat*Fcc )+( clearcoatSpecularDirect+clearcoatSpecularIndirect )*material.clearcoat;
#endif
#include <opaque_fragment>
#include <tonemapping_fragment>
#include <colorspace_fragment>
#include <fog_fragment>
#include <premultiplied_alpha_fragment>
#include <dithering_fragment>
}
`;var rh=`
#define TOON
varying vec3 vViewPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <shadowmap_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main(){
#include <uv_vertex>
#include <color_vertex>
#include <morphinstance_vertex>
#include <morphcolor_vertex>
#include <batching_vertex>
#include <beginnormal_vertex>
#include <morphnormal_vertex>
#include <skinbase_vertex>
#include <skinnormal_vertex>
#include <defaultnormal_vertex>
#include <normal_vertex>
#include <begin_vertex>
#include <morphtarget_vertex>
#include <skinning_vertex>
#include <displacementmap_vertex>
#include <project_vertex>
#include <logdepthbuf_vertex>
#include <clipping_planes_vertex>
vViewPosition=- mvPosition.xyz;
#include <worldpos_vertex>
#include <shadowmap_vertex>
#include <fog_vertex>
}
`,oh=`
#define TOON
uniform vec3 diffuse;
uniform vec3 emissive;
uniform float opacity;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <emissivemap_pars_fragment>
#include <gradientmap_pars_fragment>
#include <fog_pars_fragment>
#include <bsdfs>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <lights_toon_pars_fragment>
#include <shadowmap_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main(){
vec4 diffuseColor=vec4( diffuse,opacity );
#include <clipping_planes_fragment>
ReflectedLight reflectedLight=ReflectedLight( vec3( .0 ),vec3( .0 ),vec3( .0 ),vec3( .0 ) );
vec3 totalEmissiveRadiance=emissive;
#include <logdepthbuf_fragment>
#include <map_fragment>
#include <color_fragment>
#include <alphamap_fragment>
#include <alphatest_fragment>
#include <alphahash_fragment>
#include <normal_fragment_begin>
#include <normal_fragment_maps>
#include <emissivemap_fragment>
#include <lights_toon_fragment>
#include <lights_fragment_begin>
#include <lights_fragment_maps>
#include <lights_fragment_end>
#include <aomap_fragment>
vec3 outgoingLight=reflectedLight.directDiffuse+reflectedLight.indirectDiffuse+totalEmissiveRadiance;
#include <opaque_fragment>
#include <tonemapping_fragment>
#include <colorspace_fragment>
#include <fog_fragment>
#include <premultiplied_alpha_fragment>
#include <dithering_fragment>
}
`;var sh=`
uniform float size;
uniform float scale;
#include <common>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <morphtarget_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
#ifdef USE_POINTS_UV
varying vec2 vUv;
uniform mat3 uvTransform;
#endif
void main(){
#ifdef USE_POINTS_UV
vUv=( uvTransform*vec3( uv,1 ) ).xy;
#endif
#include <color_vertex>
#include <morphinstance_vertex>
#include <morphcolor_vertex>
#include <begin_vertex>
#include <morphtarget_vertex>
#include <project_vertex>
gl_PointSize=size;
#ifdef USE_SIZEATTENUATION
bool isPerspective=isPerspectiveMatrix( projectionMatrix );
if ( isPerspective ) gl_PointSize*=( scale/- mvPosition.z );
#endif
#include <logdepthbuf_vertex>
#include <clipping_planes_vertex>
#include <worldpos_vertex>
#include <fog_vertex>
}
`,ah=`
uniform vec3 diffuse;
uniform float opacity;
#include <common>
#include <color_pars_fragment>
#include <map_particle_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <fog_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main(){
vec4 diffuseColor=vec4( diffuse,opacity );
#include <clipping_planes_fragment>
vec3 outgoingLight=vec3( .0 );
#include <logdepthbuf_fragment>
#include <map_particle_fragment>
#include <color_fragment>
#include <alphatest_fragment>
#include <alphahash_fragment>
outgoingLight=diffuseColor.rgb;
#include <opaque_fragment>
#include <tonemapping_fragment>
#include <colorspace_fragment>
#include <fog_fragment>
#include <premultiplied_alpha_fragment>
}
`;var lh=`
#include <common>
#include <batching_pars_vertex>
#include <fog_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <shadowmap_pars_vertex>
void main(){
#include <batching_vertex>
#include <beginnormal_vertex>
#include <morphinstance_vertex>
#include <morphnormal_vertex>
#include <skinbase_vertex>
#include <skinnormal_vertex>
#include <defaultnormal_vertex>
#include <begin_vertex>
#include <morphtarget_vertex>
#include <skinning_vertex>
#include <project_vertex>
#include <logdepthbuf_vertex>
#include <worldpos_vertex>
#include <shadowmap_vertex>
#include <fog_vertex>
}
`,ch=`
uniform vec3 color;
uniform float opacity;
#include <common>
#include <fog_pars_fragment>
#include <bsdfs>
#include <lights_pars_begin>
#include <logdepthbuf_pars_fragment>
#include <shadowmap_pars_fragment>
#include <shadowmask_pars_fragment>
void main(){
#include <logdepthbuf_fragment>
gl_FragColor=vec4( color,opacity*( 1. - getShadowMask() ) );
#include <tonemapping_fragment>
#include <colorspace_fragment>
#include <fog_fragment>
#include <premultiplied_alpha_fragment>
}
`;var fh=`
uniform float rotation;
uniform vec2 center;
#include <common>
#include <uv_pars_vertex>
#include <fog_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main(){
#include <uv_vertex>
vec4 mvPosition=modelViewMatrix[ 3 ];
vec2 scale=vec2( length( modelMatrix[ 0 ].xyz ),length( modelMatrix[ 1 ].xyz ) );
#ifndef USE_SIZEATTENUATION
bool isPerspective=isPerspectiveMatrix( projectionMatrix );
if ( isPerspective ) scale*=- mvPosition.z;
#endif
vec2 alignedPosition=( position.xy - ( center - vec2( .5 ) ) )*scale;
vec2 rotatedPosition;
rotatedPosition.x=cos( rotation )*alignedPosition.x - sin( rotation )*alignedPosition.y;
rotatedPosition.y=sin( rotation )*alignedPosition.x+cos( rotation )*alignedPosition.y;
mvPosition.xy+=rotatedPosition;
gl_Position=projectionMatrix*mvPosition;
#include <logdepthbuf_vertex>
#include <clipping_planes_vertex>
#include <fog_vertex>
}
`,uh=`
uniform vec3 diffuse;
uniform float opacity;
#include <common>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <fog_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main(){
vec4 diffuseColor=vec4( diffuse,opacity );
#include <clipping_planes_fragment>
vec3 outgoingLight=vec3( .0 );
#include <logdepthbuf_fragment>
#include <map_fragment>
#include <alphamap_fragment>
#include <alphatest_fragment>
#include <alphahash_fragment>
outgoingLight=diffuseColor.rgb;
#include <opaque_fragment>
#include <tonemapping_fragment>
#include <colorspace_fragment>
#include <fog_fragment>
}
`;var Ie={alphahash_fragment:Dc,alphahash_pars_fragment:Ic,alphamap_fragment:Uc,alphamap_pars_fragment:Nc,alphatest_fragment:Fc,alphatest_pars_fragment:Oc,aomap_fragment:Bc,aomap_pars_fragment:Gc,batching_pars_vertex:zc,batching_vertex:Hc,begin_vertex:Vc,beginnormal_vertex:kc,bsdfs:Wc,iridescence_fragment:Xc,bumpmap_pars_fragment:qc,clipping_planes_fragment:Yc,clipping_planes_pars_fragment:Zc,clipping_planes_pars_vertex:Kc,clipping_planes_vertex:Jc,color_fragment:$c,color_pars_fragment:Qc,color_pars_vertex:jc,color_vertex:ef,common:tf,defaultnormal_vertex:nf,displacementmap_pars_vertex:rf,displacementmap_vertex:of,emissivemap_fragment:sf,emissivemap_pars_fragment:af,colorspace_fragment:lf,colorspace_pars_fragment:cf,envmap_fragment:ff,envmap_common_pars_fragment:uf,envmap_pars_fragment:hf,envmap_pars_vertex:df,envmap_physical_pars_fragment:yf,envmap_vertex:pf,fog_vertex:mf,fog_pars_vertex:gf,fog_fragment:_f,fog_pars_fragment:xf,gradientmap_pars_fragment:Sf,lightmap_pars_fragment:Mf,lights_lambert_fragment:vf,lights_lambert_pars_fragment:Ef,lights_pars_begin:Tf,lights_toon_fragment:Af,lights_toon_pars_fragment:bf,lights_phong_fragment:Rf,lights_phong_pars_fragment:wf,lights_physical_fragment:Cf,lights_physical_pars_fragment:Pf,lights_fragment_begin:Lf,lights_fragment_maps:Df,lights_fragment_end:If,lightprobes_pars_fragment:Uf,logdepthbuf_fragment:Nf,logdepthbuf_pars_fragment:Ff,logdepthbuf_pars_vertex:Of,logdepthbuf_vertex:Bf,map_fragment:Gf,map_pars_fragment:zf,map_particle_fragment:Hf,map_particle_pars_fragment:Vf,metalnessmap_fragment:kf,metalnessmap_pars_fragment:Wf,morphinstance_vertex:Xf,morphcolor_vertex:qf,morphnormal_vertex:Yf,morphtarget_pars_vertex:Zf,morphtarget_vertex:Kf,normal_fragment_begin:Jf,normal_fragment_maps:$f,normal_pars_fragment:Qf,normal_pars_vertex:jf,normal_vertex:eu,normalmap_pars_fragment:tu,clearcoat_normal_fragment_begin:iu,clearcoat_normal_fragment_maps:nu,clearcoat_pars_fragment:ru,iridescence_pars_fragment:ou,opaque_fragment:su,packing:au,premultiplied_alpha_fragment:lu,project_vertex:cu,dithering_fragment:fu,dithering_pars_fragment:uu,roughnessmap_fragment:hu,roughnessmap_pars_fragment:du,shadowmap_pars_fragment:pu,shadowmap_pars_vertex:mu,shadowmap_vertex:gu,shadowmask_pars_fragment:_u,skinbase_vertex:xu,skinning_pars_vertex:Su,skinning_vertex:Mu,skinnormal_vertex:vu,specularmap_fragment:Eu,specularmap_pars_fragment:Tu,tonemapping_fragment:yu,tonemapping_pars_fragment:Au,transmission_fragment:bu,transmission_pars_fragment:Ru,uv_pars_fragment:wu,uv_pars_vertex:Cu,uv_vertex:Pu,worldpos_vertex:Lu,background_vert:Du,background_frag:Iu,backgroundCube_vert:Uu,backgroundCube_frag:Nu,cube_vert:Fu,cube_frag:Ou,depth_vert:Bu,depth_frag:Gu,distance_vert:zu,distance_frag:Hu,equirect_vert:Vu,equirect_frag:ku,linedashed_vert:Wu,linedashed_frag:Xu,meshbasic_vert:qu,meshbasic_frag:Yu,meshlambert_vert:Zu,meshlambert_frag:Ku,meshmatcap_vert:Ju,meshmatcap_frag:$u,meshnormal_vert:Qu,meshnormal_frag:ju,meshphong_vert:eh,meshphong_frag:th,meshphysical_vert:ih,meshphysical_frag:nh,meshtoon_vert:rh,meshtoon_frag:oh,points_vert:sh,points_frag:ah,shadow_vert:lh,shadow_frag:ch,sprite_vert:fh,sprite_frag:uh};var ue={common:{diffuse:{value:new Me(16777215)},opacity:{value:1},map:{value:null},mapTransform:{value:new Ee},alphaMap:{value:null},alphaMapTransform:{value:new Ee},alphaTest:{value:0}},specularmap:{specularMap:{value:null},specularMapTransform:{value:new Ee}},envmap:{envMap:{value:null},envMapRotation:{value:new Ee},reflectivity:{value:1},ior:{value:1.5},refractionRatio:{value:.98},dfgLUT:{value:null}},aomap:{aoMap:{value:null},aoMapIntensity:{value:1},aoMapTransform:{value:new Ee}},lightmap:{lightMap:{value:null},lightMapIntensity:{value:1},lightMapTransform:{value:new Ee}},bumpmap:{bumpMap:{value:null},bumpMapTransform:{value:new Ee},bumpScale:{value:1}},normalmap:{normalMap:{value:null},normalMapTransform:{value:new Ee},normalScale:{value:new ye(1,1)}},displacementmap:{displacementMap:{value:null},displacementMapTransform:{value:new Ee},displacementScale:{value:1},displacementBias:{value:0}},emissivemap:{emissiveMap:{value:null},emissiveMapTransform:{value:new Ee}},metalnessmap:{metalnessMap:{value:null},metalnessMapTransform:{value:new Ee}},roughnessmap:{roughnessMap:{value:null},roughnessMapTransform:{value:new Ee}},gradientmap:{gradientMap:{value:null}},fog:{fogDensity:{value:25e-5},fogNear:{value:1},fogFar:{value:2e3},fogColor:{value:new Me(16777215)}},lights:{ambientLightColor:{value:[]},lightProbe:{value:[]},sunLights:{value:[],properties:{direction:{},color:{}}},sunLightShadows:{value:[],properties:{shadowIntensity:1,shadowBias:{},shadowNormalBias:{},shadowRadius:{},shadowMapSize:{}}},sunShadowMatrix:{value:[]},sunShadowCascade:{value:[]},directionalLights:{value:[],properties:{direction:{},color:{}}},directionalLightShadows:{value:[],properties:{shadowIntensity:1,shadowBias:{},shadowNormalBias:{},shadowRadius:{},shadowMapSize:{}}},directionalShadowMatrix:{value:[]},spotLights:{value:[],properties:{color:{},position:{},direction:{},distance:{},coneCos:{},penumbraCos:{},decay:{}}},spotLightShadows:{value:[],properties:{shadowIntensity:1,shadowBias:{},shadowNormalBias:{},shadowRadius:{},shadowMapSize:{}}},spotLightMap:{value:[]},spotLightMatrix:{value:[]},pointLights:{value:[],properties:{color:{},position:{},decay:{},distance:{}}},pointLightShadows:{value:[],properties:{shadowIntensity:1,shadowBias:{},shadowNormalBias:{},shadowRadius:{},shadowMapSize:{},shadowCameraNear:{},shadowCameraFar:{}}},pointShadowMatrix:{value:[]},hemisphereLights:{value:[],properties:{direction:{},skyColor:{},groundColor:{}}},rectAreaLights:{value:[],properties:{color:{},position:{},width:{},height:{}}},ltc_1:{value:null},ltc_2:{value:null},probesSH:{value:[]},probesMin:{value:[]},probesMax:{value:[]},probesResolution:{value:[]}},points:{diffuse:{value:new Me(16777215)},opacity:{value:1},size:{value:1},scale:{value:1},map:{value:null},alphaMap:{value:null},alphaMapTransform:{value:new Ee},alphaTest:{value:0},uvTransform:{value:new Ee}},sprite:{diffuse:{value:new Me(16777215)},opacity:{value:1},center:{value:new ye(.5,.5)},rotation:{value:0},map:{value:null},mapTransform:{value:new Ee},alphaMap:{value:null},alphaMapTransform:{value:new Ee},alphaTest:{value:0}}};var hi={basic:{uniforms:Bt([ue.common,ue.specularmap,ue.envmap,ue.aomap,ue.lightmap,ue.fog]),vertexShader:Ie.meshbasic_vert,fragmentShader:Ie.meshbasic_frag},lambert:{uniforms:Bt([ue.common,ue.specularmap,ue.envmap,ue.aomap,ue.lightmap,ue.emissivemap,ue.bumpmap,ue.normalmap,ue.displacementmap,ue.fog,ue.lights,{emissive:{value:new Me(0)},envMapIntensity:{value:1}}]),vertexShader:Ie.meshlambert_vert,fragmentShader:Ie.meshlambert_frag},phong:{uniforms:Bt([ue.common,ue.specularmap,ue.envmap,ue.aomap,ue.lightmap,ue.emissivemap,ue.bumpmap,ue.normalmap,ue.displacementmap,ue.fog,ue.lights,{emissive:{value:new Me(0)},specular:{value:new Me(1118481)},shininess:{value:30},envMapIntensity:{value:1}}]),vertexShader:Ie.meshphong_vert,fragmentShader:Ie.meshphong_frag},standard:{uniforms:Bt([ue.common,ue.envmap,ue.aomap,ue.lightmap,ue.emissivemap,ue.bumpmap,ue.normalmap,ue.displacementmap,ue.roughnessmap,ue.metalnessmap,ue.fog,ue.lights,{emissive:{value:new Me(0)},roughness:{value:1},metalness:{value:0},envMapIntensity:{value:1}}]),vertexShader:Ie.meshphysical_vert,fragmentShader:Ie.meshphysical_frag},toon:{uniforms:Bt([ue.common,ue.aomap,ue.lightmap,ue.emissivemap,ue.bumpmap,ue.normalmap,ue.displacementmap,ue.gradientmap,ue.fog,ue.lights,{emissive:{value:new Me(0)}}]),vertexShader:Ie.meshtoon_vert,fragmentShader:Ie.meshtoon_frag},matcap:{uniforms:Bt([ue.common,ue.bumpmap,ue.normalmap,ue.displacementmap,ue.fog,{matcap:{value:null}}]),vertexShader:Ie.meshmatcap_vert,fragmentShader:Ie.meshmatcap_frag},points:{uniforms:Bt([ue.points,ue.fog]),vertexShader:Ie.points_vert,fragmentShader:Ie.points_frag},dashed:{uniforms:Bt([ue.common,ue.fog,{scale:{value:1},dashSize:{value:1},totalSize:{value:2}}]),vertexShader:Ie.linedashed_vert,fragmentShader:Ie.linedashed_frag},depth:{uniforms:Bt([ue.common,ue.displacementmap]),vertexShader:Ie.depth_vert,fragmentShader:Ie.depth_frag},normal:{uniforms:Bt([ue.common,ue.bumpmap,ue.normalmap,ue.displacementmap,{opacity:{value:1}}]),vertexShader:Ie.meshnormal_vert,fragmentShader:Ie.meshnormal_frag},sprite:{uniforms:Bt([ue.sprite,ue.fog]),vertexShader:Ie.sprite_vert,fragmentShader:Ie.sprite_frag},background:{uniforms:{uvTransform:{value:new Ee},t2D:{value:null},backgroundIntensity:{value:1}},vertexShader:Ie.background_vert,fragmentShader:Ie.background_frag},backgroundCube:{uniforms:{envMap:{value:null},backgroundBlurriness:{value:0},backgroundIntensity:{value:1},backgroundRotation:{value:new Ee}},vertexShader:Ie.backgroundCube_vert,fragmentShader:Ie.backgroundCube_frag},cube:{uniforms:{tCube:{value:null},tFlip:{value:-1},opacity:{value:1}},vertexShader:Ie.cube_vert,fragmentShader:Ie.cube_frag},equirect:{uniforms:{tEquirect:{value:null}},vertexShader:Ie.equirect_vert,fragmentShader:Ie.equirect_frag},distance:{uniforms:Bt([ue.common,ue.displacementmap,{referencePosition:{value:new I},nearDistance:{value:1},farDistance:{value:1e3}}]),vertexShader:Ie.distance_vert,fragmentShader:Ie.distance_frag},shadow:{uniforms:Bt([ue.lights,ue.fog,{color:{value:new Me(0)},opacity:{value:1}}]),vertexShader:Ie.shadow_vert,fragmentShader:Ie.shadow_frag}};hi.physical={uniforms:Bt([hi.standard.uniforms,{clearcoat:{value:0},clearcoatMap:{value:null},clearcoatMapTransform:{value:new Ee},clearcoatNormalMap:{value:null},clearcoatNormalMapTransform:{value:new Ee},clearcoatNormalScale:{value:new ye(1,1)},clearcoatRoughness:{value:0},clearcoatRoughnessMap:{value:null},clearcoatRoughnessMapTransform:{value:new Ee},diffuseRoughness:{value:0},diffuseRoughnessMap:{value:null},diffuseRoughnessMapTransform:{value:new Ee},dispersion:{value:0},retroreflectivity:{value:0},iridescence:{value:0},iridescenceMap:{value:null},iridescenceMapTransform:{value:new Ee},iridescenceIOR:{value:1.3},iridescenceThicknessMinimum:{value:100},iridescenceThicknessMaximum:{value:400},iridescenceThicknessMap:{value:null},iridescenceThicknessMapTransform:{value:new Ee},sheen:{value:0},sheenColor:{value:new Me(0)},sheenColorMap:{value:null},sheenColorMapTransform:{value:new Ee},sheenRoughness:{value:1},sheenRoughnessMap:{value:null},sheenRoughnessMapTransform:{value:new Ee},transmission:{value:0},transmissionMap:{value:null},transmissionMapTransform:{value:new Ee},transmissionSamplerSize:{value:new ye},transmissionSamplerMap:{value:null},thickness:{value:0},thicknessMap:{value:null},thicknessMapTransform:{value:new Ee},attenuationDistance:{value:0},attenuationColor:{value:new Me(0)},specularColor:{value:new Me(1,1,1)},specularColorMap:{value:null},specularColorMapTransform:{value:new Ee},specularIntensity:{value:1},specularIntensityMap:{value:null},specularIntensityMapTransform:{value:new Ee},anisotropyVector:{value:new ye},anisotropyMap:{value:null},anisotropyMapTransform:{value:new Ee}}]),vertexShader:Ie.meshphysical_vert,fragmentShader:Ie.meshphysical_frag};var Vs={r:0,b:0,g:0},Ip=new we,hh=new Ee;hh.set(-1,0,0,0,1,0,0,0,1);function dh(n,e,t,i,r,o){let s=new Me(0),a=r===!0?0:1,c,l,f=null,d=0,h=null;function m(y){let A=y.isScene===!0?y.background:null;if(A&&A.isTexture){let M=y.backgroundBlurriness>0;A=e.get(A,M)}return A}function x(y){let A=!1,M=m(y);M===null?p(s,a):M&&M.isColor&&(p(M,1),A=!0);let C=n.xr.getEnvironmentBlendMode();C==="additive"?t.buffers.color.setClear(0,0,0,1,o):C==="alpha-blend"&&t.buffers.color.setClear(0,0,0,0,o),(n.autoClear||A)&&(t.buffers.depth.setTest(!0),t.buffers.depth.setMask(!0),t.buffers.color.setMask(!0),n.clear(n.autoClearColor,n.autoClearDepth,n.autoClearStencil))}function v(y,A){let M=m(A);M&&M.isCubeTexture?(l===void 0&&(l=new Ot(new er(1,1,1),new ni({name:"BackgroundCubeMaterial",uniforms:Fi(hi.backgroundCube.uniforms),vertexShader:hi.backgroundCube.vertexShader,fragmentShader:hi.backgroundCube.fragmentShader,side:at,depthTest:!1,depthWrite:!1,fog:!1,allowOverride:!1})),l.geometry.deleteAttribute("normal"),l.geometry.deleteAttribute("uv"),l.onBeforeRender=function(C,b,g){this.matrixWorld.copyPosition(g.matrixWorld)},Object.defineProperty(l.material,"envMap",{get:function(){return this.uniforms.envMap.value}}),i.update(l)),l.material.uniforms.envMap.value=M,l.material.uniforms.backgroundBlurriness.value=A.backgroundBlurriness,l.material.uniforms.backgroundIntensity.value=A.backgroundIntensity,l.material.uniforms.backgroundRotation.value.setFromMatrix4(Ip.makeRotationFromEuler(A.backgroundRotation)).transpose(),M.isRenderTargetTexture===!1&&l.material.uniforms.backgroundRotation.value.premultiply(hh),l.material.toneMapped=Re.getTransfer(M.colorSpace)!==ze,(f!==M||d!==M.version||h!==n.toneMapping)&&(l.material.needsUpdate=!0,f=M,d=M.version,h=n.toneMapping),l.layers.enableAll(),y.unshift(l,l.geometry,l.material,0,0,null)):M&&M.isTexture&&(c===void 0&&(c=new Ot(new bs(2,2),new ni({name:"BackgroundMaterial",uniforms:Fi(hi.background.uniforms),vertexShader:hi.background.vertexShader,fragmentShader:hi.background.fragmentShader,side:li,depthTest:!1,depthWrite:!1,fog:!1,allowOverride:!1})),c.geometry.deleteAttribute("normal"),Object.defineProperty(c.material,"map",{get:function(){return this.uniforms.t2D.value}}),i.update(c)),c.material.uniforms.t2D.value=M,c.material.uniforms.backgroundIntensity.value=A.backgroundIntensity,c.material.toneMapped=Re.getTransfer(M.colorSpace)!==ze,M.matrixAutoUpdate===!0&&M.updateMatrix(),c.material.uniforms.uvTransform.value.copy(M.matrix),(f!==M||d!==M.version||h!==n.toneMapping)&&(c.material.needsUpdate=!0,f=M,d=M.version,h=n.toneMapping),c.layers.enableAll(),y.unshift(c,c.geometry,c.material,0,0,null))}function p(y,A){y.getRGB(Vs,Rs(n)),t.buffers.color.setClear(Vs.r,Vs.g,Vs.b,A,o)}function u(){l!==void 0&&(l.geometry.dispose(),l.material.dispose(),l=void 0),c!==void 0&&(c.geometry.dispose(),c.material.dispose(),c=void 0)}return{getClearColor:function(){return s},setClearColor:function(y,A=1){s.set(y),a=A,p(s,a)},getClearAlpha:function(){return a},setClearAlpha:function(y){a=y,p(s,a)},render:x,addToRenderList:v,dispose:u}}function ph(n,e){let t=n.getParameter(n.MAX_VERTEX_ATTRIBS),i={},r=h(null),o=r,s=!1;function a(U,z,$,P,W){let K=!1,H=d(U,P,$,z);o!==H&&(o=H,l(o.object)),K=m(U,P,$,W),K&&x(U,P,$,W),W!==null&&e.update(W,n.ELEMENT_ARRAY_BUFFER),(K||s)&&(s=!1,M(U,z,$,P),W!==null&&n.bindBuffer(n.ELEMENT_ARRAY_BUFFER,e.get(W).buffer))}function c(){return n.createVertexArray()}function l(U){return n.bindVertexArray(U)}function f(U){return n.deleteVertexArray(U)}function d(U,z,$,P){let W=P.wireframe===!0,K=i[z.id];K===void 0&&(K={},i[z.id]=K);let H=U.isInstancedMesh===!0?U.id:0,te=K[H];te===void 0&&(te={},K[H]=te);let k=te[$.id];k===void 0&&(k={},te[$.id]=k);let J=k[W];return J===void 0&&(J=h(c()),k[W]=J),J}function h(U){let z=[],$=[],P=[];for(let W=0;W<t;W++)z[W]=0,$[W]=0,P[W]=0;return{geometry:null,program:null,wireframe:!1,newAttributes:z,enabledAttributes:$,attributeDivisors:P,object:U,attributes:{},index:null}}function m(U,z,$,P){let W=o.attributes,K=z.attributes,H=0,te=$.getAttributes();for(let k in te)if(te[k].location>=0){let Q=W[k],Se=K[k];if(Se===void 0&&(k==="instanceMatrix"&&U.instanceMatrix&&(Se=U.instanceMatrix),k==="instanceColor"&&U.instanceColor&&(Se=U.instanceColor)),Q===void 0||Q.attribute!==Se||Se&&Q.data!==Se.data)return!0;H++}return o.attributesNum!==H||o.index!==P}function x(U,z,$,P){let W={},K=z.attributes,H=0,te=$.getAttributes();for(let k in te)if(te[k].location>=0){let Q=K[k];Q===void 0&&(k==="instanceMatrix"&&U.instanceMatrix&&(Q=U.instanceMatrix),k==="instanceColor"&&U.instanceColor&&(Q=U.instanceColor));let Se={};Se.attribute=Q,Q&&Q.data&&(Se.data=Q.data),W[k]=Se,H++}o.attributes=W,o.attributesNum=H,o.index=P}function v(){let U=o.newAttributes;for(let z=0,$=U.length;z<$;z++)U[z]=0}function p(U){u(U,0)}function u(U,z){let $=o.newAttributes,P=o.enabledAttributes,W=o.attributeDivisors;$[U]=1,P[U]===0&&(n.enableVertexAttribArray(U),P[U]=1),W[U]!==z&&(n.vertexAttribDivisor(U,z),W[U]=z)}function y(){let U=o.newAttributes,z=o.enabledAttributes;for(let $=0,P=z.length;$<P;$++)z[$]!==U[$]&&(n.disableVertexAttribArray($),z[$]=0)}function A(U,z,$,P,W,K,H){H===!0?n.vertexAttribIPointer(U,z,$,W,K):n.vertexAttribPointer(U,z,$,P,W,K)}function M(U,z,$,P){v();let W=P.attributes,K=$.getAttributes(),H=z.defaultAttributeValues;for(let te in K){let k=K[te];if(k.location>=0){let J=W[te];if(J===void 0&&(te==="instanceMatrix"&&U.instanceMatrix&&(J=U.instanceMatrix),te==="instanceColor"&&U.instanceColor&&(J=U.instanceColor)),J!==void 0){let Q=J.normalized,Se=J.itemSize,Ne=e.get(J);if(Ne===void 0)continue;let Fe=Ne.buffer,Qe=Ne.type,Ye=Ne.bytesPerElement,Ze=Qe===n.INT||Qe===n.UNSIGNED_INT||J.gpuType===Sn;if(J.isInterleavedBufferAttribute){let Te=J.data,Ke=Te.isInterleavedBuffer===!0?Te.stride:Te.itemSize,pt=J.offset;if(Te.isInstancedInterleavedBuffer||Te.isInstancedBufferAttribute){for(let Ve=0;Ve<k.locationSize;Ve++)u(k.location+Ve,Te.meshPerAttribute);U.isInstancedMesh!==!0&&P._maxInstanceCount===void 0&&(P._maxInstanceCount=Te.meshPerAttribute*Te.count)}else for(let Ve=0;Ve<k.locationSize;Ve++)p(k.location+Ve);n.bindBuffer(n.ARRAY_BUFFER,Fe);for(let Ve=0;Ve<k.locationSize;Ve++)A(k.location+Ve,Se/k.locationSize,Qe,Q,Ke*Ye,(pt+Se/k.locationSize*Ve)*Ye,Ze)}else{if(J.isInstancedBufferAttribute){for(let Te=0;Te<k.locationSize;Te++)u(k.location+Te,J.meshPerAttribute);U.isInstancedMesh!==!0&&P._maxInstanceCount===void 0&&(P._maxInstanceCount=J.meshPerAttribute*J.count)}else for(let Te=0;Te<k.locationSize;Te++)p(k.location+Te);n.bindBuffer(n.ARRAY_BUFFER,Fe);for(let Te=0;Te<k.locationSize;Te++)A(k.location+Te,Se/k.locationSize,Qe,Q,Se*Ye,Se/k.locationSize*Te*Ye,Ze)}}else if(H!==void 0){let Q=H[te];if(Q!==void 0)switch(Q.length){case 2:n.vertexAttrib2fv(k.location,Q);break;case 3:n.vertexAttrib3fv(k.location,Q);break;case 4:n.vertexAttrib4fv(k.location,Q);break;default:n.vertexAttrib1fv(k.location,Q)}}}}y()}function C(){B();for(let U in i){let z=i[U];for(let $ in z){let P=z[$];for(let W in P){let K=P[W];for(let H in K)f(K[H].object),delete K[H];delete P[W]}}delete i[U]}}function b(U){if(i[U.id]===void 0)return;let z=i[U.id];for(let $ in z){let P=z[$];for(let W in P){let K=P[W];for(let H in K)f(K[H].object),delete K[H];delete P[W]}}delete i[U.id]}function g(U){for(let z in i){let $=i[z];for(let P in $){let W=$[P];if(W[U.id]===void 0)continue;let K=W[U.id];for(let H in K)f(K[H].object),delete K[H];delete W[U.id]}}}function T(U){for(let z in i){let $=i[z],P=U.isInstancedMesh===!0?U.id:0,W=$[P];if(W!==void 0){for(let K in W){let H=W[K];for(let te in H)f(H[te].object),delete H[te];delete W[K]}delete $[P],Object.keys($).length===0&&delete i[z]}}}function B(){D(),s=!0,o!==r&&(o=r,l(o.object))}function D(){r.geometry=null,r.program=null,r.wireframe=!1}return{setup:a,reset:B,resetDefaultState:D,dispose:C,releaseStatesOfGeometry:b,releaseStatesOfObject:T,releaseStatesOfProgram:g,initAttributes:v,enableAttribute:p,disableUnusedAttributes:y}}function mh(n,e,t){let i;function r(c){i=c}function o(c,l){n.drawArrays(i,c,l),t.update(l,i,1)}function s(c,l,f){f!==0&&(n.drawArraysInstanced(i,c,l,f),t.update(l,i,f))}function a(c,l,f){if(f===0)return;e.get("WEBGL_multi_draw").multiDrawArraysWEBGL(i,c,0,l,0,f);let h=0;for(let m=0;m<f;m++)h+=l[m];t.update(h,i,1)}this.setMode=r,this.render=o,this.renderInstances=s,this.renderMultiDraw=a}function gh(n,e,t,i){let r;function o(){if(r!==void 0)return r;if(e.has("EXT_texture_filter_anisotropic")===!0){let g=e.get("EXT_texture_filter_anisotropic");r=n.getParameter(g.MAX_TEXTURE_MAX_ANISOTROPY_EXT)}else r=0;return r}function s(g){return!(g!==Yt&&i.convert(g)!==n.getParameter(n.IMPLEMENTATION_COLOR_READ_FORMAT))}function a(g){let T=g===It&&(e.has("EXT_color_buffer_half_float")||e.has("EXT_color_buffer_float"));return!(g!==Tt&&g!==ut&&!T&&i.convert(g)!==n.getParameter(n.IMPLEMENTATION_COLOR_READ_TYPE))}function c(g){if(g==="highp"){if(n.getShaderPrecisionFormat(n.VERTEX_SHADER,n.HIGH_FLOAT).precision>0&&n.getShaderPrecisionFormat(n.FRAGMENT_SHADER,n.HIGH_FLOAT).precision>0)return"highp";g="mediump"}return g==="mediump"&&n.getShaderPrecisionFormat(n.VERTEX_SHADER,n.MEDIUM_FLOAT).precision>0&&n.getShaderPrecisionFormat(n.FRAGMENT_SHADER,n.MEDIUM_FLOAT).precision>0?"mediump":"lowp"}let l=t.precision!==void 0?t.precision:"highp",f=c(l);f!==l&&(pe("WebGLRenderer:",l,"not supported, using",f,"instead."),l=f);let d=t.reversedDepthBuffer===!0&&e.has("EXT_clip_control"),h=t.logarithmicDepthBuffer===!0&&d===!1;t.reversedDepthBuffer===!0&&d===!1&&pe("WebGLRenderer: Unable to use reversed depth buffer due to missing EXT_clip_control extension. Fallback to default depth buffer."),t.logarithmicDepthBuffer===!0&&d===!0&&pe("WebGLRenderer: Logarithmic depth buffer is ignored when reversed depth buffer is enabled.");let m=n.getParameter(n.MAX_TEXTURE_IMAGE_UNITS),x=n.getParameter(n.MAX_VERTEX_TEXTURE_IMAGE_UNITS),v=n.getParameter(n.MAX_TEXTURE_SIZE),p=n.getParameter(n.MAX_CUBE_MAP_TEXTURE_SIZE),u=n.getParameter(n.MAX_VERTEX_ATTRIBS),y=n.getParameter(n.MAX_VERTEX_UNIFORM_VECTORS),A=n.getParameter(n.MAX_VARYING_VECTORS),M=n.getParameter(n.MAX_FRAGMENT_UNIFORM_VECTORS),C=n.getParameter(n.MAX_SAMPLES),b=n.getParameter(n.SAMPLES);return{isWebGL2:!0,getMaxAnisotropy:o,getMaxPrecision:c,textureFormatReadable:s,textureTypeReadable:a,precision:l,logarithmicDepthBuffer:h,reversedDepthBuffer:d,maxTextures:m,maxVertexTextures:x,maxTextureSize:v,maxCubemapSize:p,maxAttributes:u,maxVertexUniforms:y,maxVaryings:A,maxFragmentUniforms:M,maxSamples:C,samples:b}}function _h(n){let e=this,t=null,i=0,r=!1,o=!1,s=new Vt,a=new Ee,c={value:null,needsUpdate:!1};this.uniform=c,this.numPlanes=0,this.numIntersection=0,this.init=function(d,h){let m=d.length!==0||h||i!==0||r;return r=h,i=d.length,m},this.beginShadows=function(){o=!0,f(null)},this.endShadows=function(){o=!1},this.setGlobalState=function(d,h){t=f(d,h,0)},this.setState=function(d,h,m){let x=d.clippingPlanes,v=d.clipIntersection,p=d.clipShadows,u=n.get(d);if(!r||x===null||x.length===0||o&&!p)o?f(null):l();else{let y=o?0:i,A=y*4,M=u.clippingState||null;c.value=M,M=f(x,h,A,m);for(let C=0;C!==A;++C)M[C]=t[C];u.clippingState=M,this.numIntersection=v?this.numPlanes:0,this.numPlanes+=y}};function l(){c.value!==t&&(c.value=t,c.needsUpdate=i>0),e.numPlanes=i,e.numIntersection=0}function f(d,h,m,x){let v=d!==null?d.length:0,p=null;if(v!==0){if(p=c.value,x!==!0||p===null){let u=m+v*4,y=h.matrixWorldInverse;a.getNormalMatrix(y),(p===null||p.length<u)&&(p=new Float32Array(u));for(let A=0,M=m;A!==v;++A,M+=4)s.copy(d[A]).applyMatrix4(y,a),s.normal.toArray(p,M),p[M+3]=s.constant}c.value=p,c.needsUpdate=!0}return e.numPlanes=v,e.numIntersection=0,p}}var lr=class extends Nt{constructor(e=1,t={}){super(e,e,t),this.isWebGLCubeRenderTarget=!0;let i={width:e,height:e,depth:1},r=[i,i,i,i,i,i];this.texture=new Qn(r),this._setTextureOptions(t),this.texture.isRenderTargetTexture=!0}fromEquirectangularTexture(e,t){this.texture.type=t.type,this.texture.colorSpace=t.colorSpace,this.texture.generateMipmaps=t.generateMipmaps,this.texture.minFilter=t.minFilter,this.texture.magFilter=t.magFilter;let i={uniforms:{tEquirect:{value:null}},vertexShader:`

				varying vec3 vWorldDirection;

				vec3 transformDirection( in vec3 dir, in mat4 matrix ) {

					return normalize( ( matrix * vec4( dir, 0.0 ) ).xyz );

				}

				void main() {

					vWorldDirection = transformDirection( position, modelMatrix );

					#include <begin_vertex>
					#include <project_vertex>

				}
			`,fragmentShader:`

				uniform sampler2D tEquirect;

				varying vec3 vWorldDirection;

				#include <common>

				void main() {

					vec3 direction = normalize( vWorldDirection );

					vec2 sampleUV = equirectUv( direction );

					gl_FragColor = texture2D( tEquirect, sampleUV );

				}
			`},r=new er(5,5,5),o=new ni({name:"CubemapFromEquirect",uniforms:Fi(i.uniforms),vertexShader:i.vertexShader,fragmentShader:i.fragmentShader,side:at,blending:Gi});o.uniforms.tEquirect.value=t;let s=new Ot(r,o),a=t.minFilter;return t.minFilter===pi&&(t.minFilter=ft),new Gs(1,10,this).update(e,s),t.minFilter=a,s.geometry.dispose(),s.material.dispose(),this}clear(e,t=!0,i=!0,r=!0){let o=e.getRenderTarget();for(let s=0;s<6;s++)e.setRenderTarget(this,s),e.clear(t,i,r);e.setRenderTarget(o)}};var ks=class{};function xh(n){let e=new WeakMap,t=new WeakMap,i=null;function r(h,m=!1){return h==null?null:m?s(h):o(h)}function o(h){if(h&&h.isTexture){let m=h.mapping;if(m===bo||m===Ro)if(e.has(h)){let x=e.get(h).texture;return a(x,h.mapping)}else{let x=h.image;if(x&&x.height>0){let v=new lr(x.height);return v.fromEquirectangularTexture(n,h),e.set(h,v),h.addEventListener("dispose",l),a(v.texture,h.mapping)}else return null}}return h}function s(h){if(h&&h.isTexture&&h.isPMREMTexture!==!0){let m=h.mapping,x=m===bo||m===Ro,v=m===on||m===Sr;if(x||v){let p=t.get(h),u=p!==void 0?p.texture.pmremVersion:0;if(h.isRenderTargetTexture&&h.pmremVersion!==u)return i===null&&(i=new ks(n)),p=x?i.fromEquirectangular(h,p):i.fromCubemap(h,p),p.texture.pmremVersion=h.pmremVersion,t.set(h,p),p.texture;if(p!==void 0)return p.texture;{let y=h.image;return x&&y&&y.height>0||v&&y&&c(y)?(i===null&&(i=new ks(n)),p=x?i.fromEquirectangular(h):i.fromCubemap(h),p.texture.pmremVersion=h.pmremVersion,t.set(h,p),h.addEventListener("dispose",f),p.texture):null}}}return h}function a(h,m){return m===bo?h.mapping=on:m===Ro&&(h.mapping=Sr),h}function c(h){let m=0,x=6;for(let v=0;v<x;v++)h[v]!==void 0&&m++;return m===x}function l(h){let m=h.target;m.removeEventListener("dispose",l);let x=e.get(m);x!==void 0&&(e.delete(m),x.dispose())}function f(h){let m=h.target;m.removeEventListener("dispose",f);let x=t.get(m);x!==void 0&&(t.delete(m),x.dispose())}function d(){e=new WeakMap,t=new WeakMap,i!==null&&(i.dispose(),i=null)}return{get:r,dispose:d}}function Sh(n){let e={};function t(i){if(e[i]!==void 0)return e[i];let r=n.getExtension(i);return e[i]=r,r}return{has:function(i){return t(i)!==null},init:function(){t("EXT_color_buffer_float"),t("WEBGL_clip_cull_distance"),t("OES_texture_float_linear"),t("EXT_color_buffer_half_float"),t("WEBGL_multisampled_render_to_texture"),t("WEBGL_render_shared_exponent")},get:function(i){let r=t(i);return r===null&&fn("WebGLRenderer: "+i+" extension not supported."),r}}}function Mh(n,e,t,i){let r={},o=new WeakMap,s=new FinalizationRegistry(x=>delete r[x]);function a(x){c(x.target)}function c(x){x.index!==null&&e.remove(x.index);for(let p in x.attributes)e.remove(x.attributes[p]);x.removeEventListener("dispose",a),delete r[x.id],s.unregister(x);let v=o.get(x);v&&(e.remove(v),o.delete(x)),i.releaseStatesOfGeometry(x),x.isInstancedBufferGeometry===!0&&delete x._maxInstanceCount,t.memory.geometries--}function l(x,v){return r[v.id]!==void 0||(v.addEventListener("dispose",a),r[v.id]=new WeakRef(v),s.register(v,v.id,v),t.memory.geometries++),v}function f(x){let v=x.attributes;for(let p in v)e.update(v[p],n.ARRAY_BUFFER)}function d(x){let v=x.index,p=x.attributes.position,u=0;if(p===void 0)return;let y=v!==null?v.array.length:p.array.length/3-1,A=p.count>=65535?qn:Xn,M=new A(Math.ceil(y/3)*6,1),C=M.array;if(v!==null){let g=v.array;u=v.version;for(let T=0,B=0;T<y;T+=3){let D=g[T+0],U=g[T+1],z=g[T+2];C[B++]=D,C[B++]=U,C[B++]=U,C[B++]=z,C[B++]=z,C[B++]=D}}else{u=p.version;for(let g=0,T=0;g<y;g+=3){let B=g+0,D=g+1,U=g+2;C[T++]=B,C[T++]=D,C[T++]=D,C[T++]=U,C[T++]=U,C[T++]=B}}M.version=u;let b=o.get(x);b&&e.remove(b),o.set(x,M)}function h(x){let v=o.get(x);if(v){let p=x.index;p!==null&&v.version<p.version&&d(x)}else d(x);return o.get(x)}function m(){for(let x in r){let v=r[x].deref();v!==void 0&&c(v)}}return{get:l,update:f,getWireframeAttribute:h,dispose:m}}function vh(n,e,t){let i;function r(d){i=d}let o,s;function a(d){o=d.type,s=d.bytesPerElement}function c(d,h){n.drawElements(i,h,o,d*s),t.update(h,i,1)}function l(d,h,m){m!==0&&(n.drawElementsInstanced(i,h,o,d*s,m),t.update(h,i,m))}function f(d,h,m){if(m===0)return;e.get("WEBGL_multi_draw").multiDrawElementsWEBGL(i,h,0,o,d,0,m);let v=0;for(let p=0;p<m;p++)v+=h[p];t.update(v,i,1)}this.setMode=r,this.setIndex=a,this.render=c,this.renderInstances=l,this.renderMultiDraw=f}function Eh(n){let e={geometries:0,textures:0},t={frame:0,calls:0,triangles:0,points:0,lines:0};function i(o,s,a){switch(t.calls++,s){case n.TRIANGLES:t.triangles+=a*(o/3);break;case n.LINES:t.lines+=a*(o/2);break;case n.LINE_STRIP:t.lines+=a*(o-1);break;case n.LINE_LOOP:t.lines+=a*o;break;case n.POINTS:t.points+=a*o;break;default:Oe("WebGLInfo: Unknown draw mode:",s);break}}function r(){t.calls=0,t.triangles=0,t.points=0,t.lines=0}return{memory:e,render:t,programs:null,autoReset:!0,reset:r,update:i}}function Th(n,e,t){let i=new WeakMap,r=new We;function o(s,a,c){let l=s.morphTargetInfluences,f=a.morphAttributes.position||a.morphAttributes.normal||a.morphAttributes.color,d=f!==void 0?f.length:0,h=i.get(a);if(h===void 0||h.count!==d){let B=function(){g.dispose(),i.delete(a),a.removeEventListener("dispose",B)};h!==void 0&&h.texture.dispose();let m=a.morphAttributes.position!==void 0,x=a.morphAttributes.normal!==void 0,v=a.morphAttributes.color!==void 0,p=a.morphAttributes.position||[],u=a.morphAttributes.normal||[],y=a.morphAttributes.color||[],A=0;m===!0&&(A=1),x===!0&&(A=2),v===!0&&(A=3);let M=a.attributes.position.count*A,C=1;M>e.maxTextureSize&&(C=Math.ceil(M/e.maxTextureSize),M=e.maxTextureSize);let b=new Float32Array(M*C*4*d),g=new Nn(b,M,C,d);g.type=ut,g.needsUpdate=!0;let T=A*4;for(let D=0;D<d;D++){let U=p[D],z=u[D],$=y[D],P=M*C*4*D;for(let W=0;W<U.count;W++){let K=W*T;m===!0&&(r.fromBufferAttribute(U,W),b[P+K+0]=r.x,b[P+K+1]=r.y,b[P+K+2]=r.z,b[P+K+3]=0),x===!0&&(r.fromBufferAttribute(z,W),b[P+K+4]=r.x,b[P+K+5]=r.y,b[P+K+6]=r.z,b[P+K+7]=0),v===!0&&(r.fromBufferAttribute($,W),b[P+K+8]=r.x,b[P+K+9]=r.y,b[P+K+10]=r.z,b[P+K+11]=$.itemSize===4?r.w:1)}}h={count:d,texture:g,size:new ye(M,C)},i.set(a,h),a.addEventListener("dispose",B)}if(s.isInstancedMesh===!0&&s.morphTexture!==null)c.getUniforms().setValue(n,"morphTexture",s.morphTexture,t);else{let m=0;for(let v=0;v<l.length;v++)m+=l[v];let x=a.morphTargetsRelative?1:1-m;c.getUniforms().setValue(n,"morphTargetBaseInfluence",x),c.getUniforms().setValue(n,"morphTargetInfluences",l)}c.getUniforms().setValue(n,"morphTargetsTexture",h.texture,t),c.getUniforms().setValue(n,"morphTargetsTextureSize",h.size)}return{update:o}}function yh(n,e,t,i,r){let o=new WeakMap;function s(l){let f=r.render.frame,d=l.geometry,h=e.get(l,d);if(o.get(h)!==f&&(e.update(h),o.set(h,f)),l.isInstancedMesh&&(l.hasEventListener("dispose",c)===!1&&l.addEventListener("dispose",c),o.get(l)!==f&&(t.update(l.instanceMatrix,n.ARRAY_BUFFER),l.instanceColor!==null&&t.update(l.instanceColor,n.ARRAY_BUFFER),o.set(l,f))),l.isSkinnedMesh){let m=l.skeleton;o.get(m)!==f&&(m.update(),o.set(m,f))}return h}function a(){o=new WeakMap}function c(l){let f=l.target;f.removeEventListener("dispose",c),i.releaseStatesOfObject(f),t.remove(f.instanceMatrix),f.instanceColor!==null&&t.remove(f.instanceColor)}return{update:s,dispose:a}}var Up={[Mo]:"LINEAR_TONE_MAPPING",[vo]:"REINHARD_TONE_MAPPING",[Eo]:"CINEON_TONE_MAPPING",[xr]:"ACES_FILMIC_TONE_MAPPING",[yo]:"AGX_TONE_MAPPING",[Ao]:"NEUTRAL_TONE_MAPPING",[To]:"CUSTOM_TONE_MAPPING"};function Ah(n,e,t,i,r,o){let s=new Nt(e,t,{type:n,depthBuffer:r,stencilBuffer:o,samples:i?4:0,storeMultisampledDepthBuffer:!1,storeMultisampledStencilBuffer:!1,resolveDepthBuffer:!1,resolveStencilBuffer:!1}),a=null,c=null,l=null,f=new nt;f.setAttribute("position",new $e([-1,3,0,-1,-1,0,3,-1,0],3)),f.setAttribute("uv",new $e([0,2,0,0,2,0],2));let d=new ws({uniforms:{tDiffuse:{value:null}},vertexShader:`
			precision highp float;

			uniform mat4 modelViewMatrix;
			uniform mat4 projectionMatrix;

			attribute vec3 position;
			attribute vec2 uv;

			varying vec2 vUv;

			void main() {
				vUv = uv;
				gl_Position = projectionMatrix * modelViewMatrix * vec4( position, 1.0 );
			}`,fragmentShader:`
			precision highp float;

			uniform sampler2D tDiffuse;

			varying vec2 vUv;

			#include <tonemapping_pars_fragment>
			#include <colorspace_pars_fragment>

			void main() {
				gl_FragColor = texture2D( tDiffuse, vUv );

				#ifdef LINEAR_TONE_MAPPING
					gl_FragColor.rgb = LinearToneMapping( gl_FragColor.rgb );
				#elif defined( REINHARD_TONE_MAPPING )
					gl_FragColor.rgb = ReinhardToneMapping( gl_FragColor.rgb );
				#elif defined( CINEON_TONE_MAPPING )
					gl_FragColor.rgb = CineonToneMapping( gl_FragColor.rgb );
				#elif defined( ACES_FILMIC_TONE_MAPPING )
					gl_FragColor.rgb = ACESFilmicToneMapping( gl_FragColor.rgb );
				#elif defined( AGX_TONE_MAPPING )
					gl_FragColor.rgb = AgXToneMapping( gl_FragColor.rgb );
				#elif defined( NEUTRAL_TONE_MAPPING )
					gl_FragColor.rgb = NeutralToneMapping( gl_FragColor.rgb );
				#elif defined( CUSTOM_TONE_MAPPING )
					gl_FragColor.rgb = CustomToneMapping( gl_FragColor.rgb );
				#endif

				#ifdef SRGB_TRANSFER
					gl_FragColor = sRGBTransferOETF( gl_FragColor );
				#endif
			}`,depthTest:!1,depthWrite:!1}),h=new Ot(f,d),m=new $i(-1,1,1,-1,0,1),x=null,v=null,p=!1,u,y=null,A=[],M=!1;this.setSize=function(C,b){s.setSize(C,b),a!==null&&a.setSize(C,b),c!==null&&c.setSize(C,b);for(let g=0;g<A.length;g++){let T=A[g];T.setSize&&T.setSize(C,b)}},this.setEffects=function(C){A=C,M=A.length>0&&A[0].isRenderPass===!0;let b=s.width,g=s.height;A.length>0&&a===null&&(a=new Nt(b,g,{type:It,depthBuffer:!1,stencilBuffer:!1}),c=new Nt(b,g,{type:It,depthBuffer:!1,stencilBuffer:!1}));let T=r===!0&&A.some(B=>B.needsDepthTexture===!0);T!==(s.depthTexture!==null)&&(T===!0&&l===null&&(l=new vi(b,g),o===!0&&(l.format=mi,l.type=Ci)),s.dispose(),s.depthTexture=T?l:null,s.resolveDepthBuffer=T,s.storeMultisampledDepthBuffer=T);for(let B=0;B<A.length;B++){let D=A[B];D.setSize&&D.setSize(b,g),T&&D.needsDepthTexture===!0&&D.setDepthTexture&&D.setDepthTexture(l)}},this.begin=function(C,b){if(p||C.toneMapping===Xt&&A.length===0)return!1;if(y=b,b!==null){let g=b.width,T=b.height;(s.width!==g||s.height!==T)&&this.setSize(g,T)}return M===!1&&C.setRenderTarget(s),u=C.toneMapping,C.toneMapping=Xt,!0},this.hasRenderPass=function(){return M},this.end=function(C,b){C.toneMapping=u,p=!0;let g=s,T=a;for(let B=0;B<A.length;B++){let D=A[B];D.enabled!==!1&&(D.render(C,T,g,b),D.needsSwap!==!1&&(g=T,T=T===a?c:a))}if(x!==C.outputColorSpace||v!==C.toneMapping){x=C.outputColorSpace,v=C.toneMapping,d.defines={},Re.getTransfer(x)===ze&&(d.defines.SRGB_TRANSFER="");let B=Up[v];B&&(d.defines[B]=""),d.needsUpdate=!0}d.uniforms.tDiffuse.value=g.texture,C.setRenderTarget(y),C.render(h,m),y=null,p=!1},this.isCompositing=function(){return p},this.dispose=function(){s.dispose(),a!==null&&a.dispose(),c!==null&&c.dispose(),f.dispose(),d.dispose()}}var Dh=new lt,Ih=new vi(1,1),Uh=new jn(1),Nh=new Nn,Fh=new ko,Oh=new Qn,bh=[],Rh=[],wh=new Float32Array(16),Ch=new Float32Array(9),Ph=new Float32Array(4);function cr(n,e,t){let i=n[0];if(i<=0||i>0)return n;let r=e*t,o=bh[r];if(o===void 0&&(o=new Float32Array(r),bh[r]=o),e!==0){i.toArray(o,0);for(let s=1,a=0;s!==e;++s)a+=t,n[s].toArray(o,a)}return o}function xt(n,e){if(n.length!==e.length)return!1;for(let t=0,i=n.length;t<i;t++)if(n[t]!==e[t])return!1;return!0}function St(n,e){for(let t=0,i=e.length;t<i;t++)n[t]=e[t]}function Ws(n,e){let t=Rh[e];t===void 0&&(t=new Int32Array(e),Rh[e]=t);for(let i=0;i!==e;++i)t[i]=n.allocateTextureUnit();return t}function Np(n,e){let t=this.cache;t[0]!==e&&(n.uniform1f(this.addr,e),t[0]=e)}function Fp(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y)&&(n.uniform2f(this.addr,e.x,e.y),t[0]=e.x,t[1]=e.y);else{if(xt(t,e))return;n.uniform2fv(this.addr,e),St(t,e)}}function Op(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y||t[2]!==e.z)&&(n.uniform3f(this.addr,e.x,e.y,e.z),t[0]=e.x,t[1]=e.y,t[2]=e.z);else if(e.r!==void 0)(t[0]!==e.r||t[1]!==e.g||t[2]!==e.b)&&(n.uniform3f(this.addr,e.r,e.g,e.b),t[0]=e.r,t[1]=e.g,t[2]=e.b);else{if(xt(t,e))return;n.uniform3fv(this.addr,e),St(t,e)}}function Bp(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y||t[2]!==e.z||t[3]!==e.w)&&(n.uniform4f(this.addr,e.x,e.y,e.z,e.w),t[0]=e.x,t[1]=e.y,t[2]=e.z,t[3]=e.w);else{if(xt(t,e))return;n.uniform4fv(this.addr,e),St(t,e)}}function Gp(n,e){let t=this.cache,i=e.elements;if(i===void 0){if(xt(t,e))return;n.uniformMatrix2fv(this.addr,!1,e),St(t,e)}else{if(xt(t,i))return;Ph.set(i),n.uniformMatrix2fv(this.addr,!1,Ph),St(t,i)}}function zp(n,e){let t=this.cache,i=e.elements;if(i===void 0){if(xt(t,e))return;n.uniformMatrix3fv(this.addr,!1,e),St(t,e)}else{if(xt(t,i))return;Ch.set(i),n.uniformMatrix3fv(this.addr,!1,Ch),St(t,i)}}function Hp(n,e){let t=this.cache,i=e.elements;if(i===void 0){if(xt(t,e))return;n.uniformMatrix4fv(this.addr,!1,e),St(t,e)}else{if(xt(t,i))return;wh.set(i),n.uniformMatrix4fv(this.addr,!1,wh),St(t,i)}}function Vp(n,e){let t=this.cache;t[0]!==e&&(n.uniform1i(this.addr,e),t[0]=e)}function kp(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y)&&(n.uniform2i(this.addr,e.x,e.y),t[0]=e.x,t[1]=e.y);else{if(xt(t,e))return;n.uniform2iv(this.addr,e),St(t,e)}}function Wp(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y||t[2]!==e.z)&&(n.uniform3i(this.addr,e.x,e.y,e.z),t[0]=e.x,t[1]=e.y,t[2]=e.z);else{if(xt(t,e))return;n.uniform3iv(this.addr,e),St(t,e)}}function Xp(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y||t[2]!==e.z||t[3]!==e.w)&&(n.uniform4i(this.addr,e.x,e.y,e.z,e.w),t[0]=e.x,t[1]=e.y,t[2]=e.z,t[3]=e.w);else{if(xt(t,e))return;n.uniform4iv(this.addr,e),St(t,e)}}function qp(n,e){let t=this.cache;t[0]!==e&&(n.uniform1ui(this.addr,e),t[0]=e)}function Yp(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y)&&(n.uniform2ui(this.addr,e.x,e.y),t[0]=e.x,t[1]=e.y);else{if(xt(t,e))return;n.uniform2uiv(this.addr,e),St(t,e)}}function Zp(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y||t[2]!==e.z)&&(n.uniform3ui(this.addr,e.x,e.y,e.z),t[0]=e.x,t[1]=e.y,t[2]=e.z);else{if(xt(t,e))return;n.uniform3uiv(this.addr,e),St(t,e)}}function Kp(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y||t[2]!==e.z||t[3]!==e.w)&&(n.uniform4ui(this.addr,e.x,e.y,e.z,e.w),t[0]=e.x,t[1]=e.y,t[2]=e.z,t[3]=e.w);else{if(xt(t,e))return;n.uniform4uiv(this.addr,e),St(t,e)}}function Xs(n){return n.version===0&&(n.compareFunction=Bo,n.needsUpdate=!0),n}function Jp(n,e,t){let i=this.cache,r=t.allocateTextureUnit();i[0]!==r&&(n.uniform1i(this.addr,r),i[0]=r);let o;this.type===n.SAMPLER_2D_SHADOW?o=Xs(Ih):o=Dh,t.setTexture2D(e||o,r)}function $p(n,e,t){let i=this.cache,r=t.allocateTextureUnit();i[0]!==r&&(n.uniform1i(this.addr,r),i[0]=r),t.setTexture3D(e||Fh,r)}function Qp(n,e,t){let i=this.cache,r=t.allocateTextureUnit();i[0]!==r&&(n.uniform1i(this.addr,r),i[0]=r);let o;this.type===n.SAMPLER_CUBE_SHADOW?o=Xs(Uh):o=Oh,t.setTextureCube(e||o,r)}function jp(n,e,t){let i=this.cache,r=t.allocateTextureUnit();i[0]!==r&&(n.uniform1i(this.addr,r),i[0]=r),t.setTexture2DArray(e||Nh,r)}function em(n){switch(n){case 5126:return Np;case 35664:return Fp;case 35665:return Op;case 35666:return Bp;case 35674:return Gp;case 35675:return zp;case 35676:return Hp;case 5124:case 35670:return Vp;case 35667:case 35671:return kp;case 35668:case 35672:return Wp;case 35669:case 35673:return Xp;case 5125:return qp;case 36294:return Yp;case 36295:return Zp;case 36296:return Kp;case 35678:case 36198:case 36298:case 36306:case 35682:return Jp;case 35679:case 36299:case 36307:return $p;case 35680:case 36300:case 36308:case 36293:return Qp;case 36289:case 36303:case 36311:case 36292:return jp}}function tm(n,e){n.uniform1fv(this.addr,e)}function im(n,e){let t=cr(e,this.size,2);n.uniform2fv(this.addr,t)}function nm(n,e){let t=cr(e,this.size,3);n.uniform3fv(this.addr,t)}function rm(n,e){let t=cr(e,this.size,4);n.uniform4fv(this.addr,t)}function om(n,e){let t=cr(e,this.size,4);n.uniformMatrix2fv(this.addr,!1,t)}function sm(n,e){let t=cr(e,this.size,9);n.uniformMatrix3fv(this.addr,!1,t)}function am(n,e){let t=cr(e,this.size,16);n.uniformMatrix4fv(this.addr,!1,t)}function lm(n,e){n.uniform1iv(this.addr,e)}function cm(n,e){n.uniform2iv(this.addr,e)}function fm(n,e){n.uniform3iv(this.addr,e)}function um(n,e){n.uniform4iv(this.addr,e)}function hm(n,e){n.uniform1uiv(this.addr,e)}function dm(n,e){n.uniform2uiv(this.addr,e)}function pm(n,e){n.uniform3uiv(this.addr,e)}function mm(n,e){n.uniform4uiv(this.addr,e)}function gm(n,e,t){let i=this.cache,r=e.length,o=Ws(t,r);xt(i,o)||(n.uniform1iv(this.addr,o),St(i,o));let s;this.type===n.SAMPLER_2D_SHADOW?s=Xs(Ih):s=Dh;for(let a=0;a!==r;++a)t.setTexture2D(e[a]||s,o[a])}function _m(n,e,t){let i=this.cache,r=e.length,o=Ws(t,r);xt(i,o)||(n.uniform1iv(this.addr,o),St(i,o));for(let s=0;s!==r;++s)t.setTexture3D(e[s]||Fh,o[s])}function xm(n,e,t){let i=this.cache,r=e.length,o=Ws(t,r);xt(i,o)||(n.uniform1iv(this.addr,o),St(i,o));let s;this.type===n.SAMPLER_CUBE_SHADOW?s=Xs(Uh):s=Oh;for(let a=0;a!==r;++a)t.setTextureCube(e[a]||s,o[a])}function Sm(n,e,t){let i=this.cache,r=e.length,o=Ws(t,r);xt(i,o)||(n.uniform1iv(this.addr,o),St(i,o));for(let s=0;s!==r;++s)t.setTexture2DArray(e[s]||Nh,o[s])}function Mm(n){switch(n){case 5126:return tm;case 35664:return im;case 35665:return nm;case 35666:return rm;case 35674:return om;case 35675:return sm;case 35676:return am;case 5124:case 35670:return lm;case 35667:case 35671:return cm;case 35668:case 35672:return fm;case 35669:case 35673:return um;case 5125:return hm;case 36294:return dm;case 36295:return pm;case 36296:return mm;case 35678:case 36198:case 36298:case 36306:case 35682:return gm;case 35679:case 36299:case 36307:return _m;case 35680:case 36300:case 36308:case 36293:return xm;case 36289:case 36303:case 36311:case 36292:return Sm}}var Ba=class{constructor(e,t,i){this.id=e,this.addr=i,this.cache=[],this.type=t.type,this.setValue=em(t.type)}},Ga=class{constructor(e,t,i){this.id=e,this.addr=i,this.cache=[],this.type=t.type,this.size=t.size,this.setValue=Mm(t.type)}},za=class{constructor(e){this.id=e,this.seq=[],this.map={}}setValue(e,t,i){let r=this.seq;for(let o=0,s=r.length;o!==s;++o){let a=r[o];a.setValue(e,t[a.id],i)}}},Oa=/(\w+)(\])?(\[|\.)?/g;function Lh(n,e){n.seq.push(e),n.map[e.id]=e}function vm(n,e,t){let i=n.name,r=i.length;for(Oa.lastIndex=0;;){let o=Oa.exec(i),s=Oa.lastIndex,a=o[1],c=o[2]==="]",l=o[3];if(c&&(a=a|0),l===void 0||l==="["&&s+2===r){Lh(t,l===void 0?new Ba(a,n,e):new Ga(a,n,e));break}else{let d=t.map[a];d===void 0&&(d=new za(a),Lh(t,d)),t=d}}}var Qi=class{constructor(e,t){this.seq=[],this.map={};let i=e.getProgramParameter(t,e.ACTIVE_UNIFORMS);for(let s=0;s<i;++s){let a=e.getActiveUniform(t,s),c=e.getUniformLocation(t,a.name);vm(a,c,this)}let r=[],o=[];for(let s of this.seq)s.type===e.SAMPLER_2D_SHADOW||s.type===e.SAMPLER_CUBE_SHADOW||s.type===e.SAMPLER_2D_ARRAY_SHADOW?r.push(s):o.push(s);r.length>0&&(this.seq=r.concat(o))}setValue(e,t,i,r){let o=this.map[t];o!==void 0&&o.setValue(e,i,r)}setOptional(e,t,i){let r=t[i];r!==void 0&&this.setValue(e,i,r)}static upload(e,t,i,r){for(let o=0,s=t.length;o!==s;++o){let a=t[o],c=i[a.id];c.needsUpdate!==!1&&a.setValue(e,c.value,r)}}static seqWithValue(e,t){let i=[];for(let r=0,o=e.length;r!==o;++r){let s=e[r];s.id in t&&i.push(s)}return i}};function Ha(n,e,t){let i=n.createShader(e);return n.shaderSource(i,t),n.compileShader(i),i}var Em=37297,Tm=0;function ym(n,e){let t=n.split(`
`),i=[],r=Math.max(e-6,0),o=Math.min(e+6,t.length);for(let s=r;s<o;s++){let a=s+1;i.push(`${a===e?">":" "} ${a}: ${t[s]}`)}return i.join(`
`)}var Bh=new Ee;function Am(n){Re._getMatrix(Bh,Re.workingColorSpace,n);let e=`mat3( ${Bh.elements.map(t=>t.toFixed(4))} )`;switch(Re.getTransfer(n)){case cn:return[e,"LinearTransferOETF"];case ze:return[e,"sRGBTransferOETF"];default:return pe("WebGLProgram: Unsupported color space: ",n),[e,"LinearTransferOETF"]}}function Gh(n,e,t){let i=n.getShaderParameter(e,n.COMPILE_STATUS),o=(n.getShaderInfoLog(e)||"").trim();if(i&&o==="")return"";let s=/ERROR: 0:(\d+)/.exec(o);if(s){let a=parseInt(s[1]);return t.toUpperCase()+`

`+o+`

`+ym(n.getShaderSource(e),a)}else return o}function bm(n,e){let t=Am(e);return[`vec4 ${n}( vec4 value ) {`,`	return ${t[1]}( vec4( ${t[0]} * value.rgb, value.a ) );`,"}"].join(`
`)}var Rm={[Mo]:"Linear",[vo]:"Reinhard",[Eo]:"Cineon",[xr]:"ACESFilmic",[yo]:"AgX",[Ao]:"Neutral",[To]:"Custom"};function wm(n,e){let t=Rm[e];return t===void 0?(pe("WebGLProgram: Unsupported toneMapping:",e),"vec3 "+n+"( vec3 color ) { return LinearToneMapping( color ); }"):"vec3 "+n+"( vec3 color ) { return "+t+"ToneMapping( color ); }"}var qs=new I;function Cm(){Re.getLuminanceCoefficients(qs);let n=qs.x.toFixed(4),e=qs.y.toFixed(4),t=qs.z.toFixed(4);return["float luminance( const in vec3 rgb ) {",`	const vec3 weights = vec3( ${n}, ${e}, ${t} );`,"	return dot( weights, rgb );","}"].join(`
`)}function Pm(n){return[n.extensionClipCullDistance?"#extension GL_ANGLE_clip_cull_distance : require":"",n.extensionMultiDraw?"#extension GL_ANGLE_multi_draw : require":""].filter(po).join(`
`)}function Lm(n){let e=[];for(let t in n){let i=n[t];i!==!1&&e.push("#define "+t+" "+i)}return e.join(`
`)}function Dm(n,e){let t={},i=n.getProgramParameter(e,n.ACTIVE_ATTRIBUTES);for(let r=0;r<i;r++){let o=n.getActiveAttrib(e,r),s=o.name,a=1;o.type===n.FLOAT_MAT2&&(a=2),o.type===n.FLOAT_MAT3&&(a=3),o.type===n.FLOAT_MAT4&&(a=4),t[s]={type:o.type,location:n.getAttribLocation(e,s),locationSize:a}}return t}function po(n){return n!==""}function zh(n,e){let t=e.numSpotLightShadows+e.numSpotLightMaps-e.numSpotLightShadowsWithMaps;return n.replace(/NUM_SUN_LIGHTS/g,e.numSunLights).replace(/NUM_DIR_LIGHTS/g,e.numDirLights).replace(/NUM_SPOT_LIGHTS/g,e.numSpotLights).replace(/NUM_SPOT_LIGHT_MAPS/g,e.numSpotLightMaps).replace(/NUM_SPOT_LIGHT_COORDS/g,t).replace(/NUM_RECT_AREA_LIGHTS/g,e.numRectAreaLights).replace(/NUM_POINT_LIGHTS/g,e.numPointLights).replace(/NUM_HEMI_LIGHTS/g,e.numHemiLights).replace(/NUM_SUN_LIGHT_SHADOWS/g,e.numSunLightShadows).replace(/NUM_DIR_LIGHT_SHADOWS/g,e.numDirLightShadows).replace(/NUM_SPOT_LIGHT_SHADOWS_WITH_MAPS/g,e.numSpotLightShadowsWithMaps).replace(/NUM_SPOT_LIGHT_SHADOWS/g,e.numSpotLightShadows).replace(/NUM_POINT_LIGHT_SHADOWS/g,e.numPointLightShadows).replace(/NUM_LIGHT_PROBE_GRIDS/g,e.numLightProbeGrids)}function Hh(n,e){return n.replace(/NUM_CLIPPING_PLANES/g,e.numClippingPlanes).replace(/UNION_CLIPPING_PLANES/g,e.numClippingPlanes-e.numClipIntersection)}var Im=/^[ \t]*#include +<([\w\d./]+)>/gm;function Va(n){return n.replace(Im,Um)}function Um(n,e){let t=Ie[e];if(t===void 0)throw new Error("THREE.WebGLProgram: Can not resolve #include <"+e+">");return Va(t)}var Nm=/#pragma unroll_loop_start\s+for\s*\(\s*int\s+i\s*=\s*(\d+)\s*;\s*i\s*<\s*(\d+)\s*;\s*i\s*\+\+\s*\)\s*{([\s\S]+?)}\s+#pragma unroll_loop_end/g;function Vh(n){return n.replace(Nm,Fm)}function Fm(n,e,t,i){let r="";for(let o=parseInt(e);o<parseInt(t);o++)r+=i.replace(/\[\s*i\s*\]/g,"[ "+o+" ]").replace(/UNROLLED_LOOP_INDEX/g,o);return r}function kh(n){let e=`precision ${n.precision} float;
	precision ${n.precision} int;
	precision ${n.precision} sampler2D;
	precision ${n.precision} samplerCube;
	precision ${n.precision} sampler3D;
	precision ${n.precision} sampler2DArray;
	precision ${n.precision} sampler2DShadow;
	precision ${n.precision} samplerCubeShadow;
	precision ${n.precision} sampler2DArrayShadow;
	precision ${n.precision} isampler2D;
	precision ${n.precision} isampler3D;
	precision ${n.precision} isamplerCube;
	precision ${n.precision} isampler2DArray;
	precision ${n.precision} usampler2D;
	precision ${n.precision} usampler3D;
	precision ${n.precision} usamplerCube;
	precision ${n.precision} usampler2DArray;
	`;return n.precision==="highp"?e+=`
#define HIGH_PRECISION`:n.precision==="mediump"?e+=`
#define MEDIUM_PRECISION`:n.precision==="lowp"&&(e+=`
#define LOW_PRECISION`),e}var Om={[nn]:"SHADOWMAP_TYPE_PCF",[rn]:"SHADOWMAP_TYPE_VSM"};function Bm(n){return Om[n.shadowMapType]||"SHADOWMAP_TYPE_BASIC"}var Gm={[Sr]:"ENVMAP_MODE_REFRACTION"};function zm(n){return n.envMap===!1?"ENVMAP_MODE_REFLECTION":Gm[n.envMapMode]||"ENVMAP_MODE_REFLECTION"}var Hm={[xn]:"ENVMAP_BLENDING_MULTIPLY",[Tl]:"ENVMAP_BLENDING_MIX",[yl]:"ENVMAP_BLENDING_ADD"};function Vm(n){return n.envMap===!1?"ENVMAP_BLENDING_NONE":Hm[n.combine]||"ENVMAP_BLENDING_NONE"}function Wh(n,e,t,i){let r=n.getContext(),o=t.defines,s=t.vertexShader,a=t.fragmentShader,c=Bm(t),l=t.envMapPMREM===!0?"ENVMAP_TYPE_PMREM":"ENVMAP_TYPE_CUBE",f=zm(t),d=Vm(t),h=Pm(t),m=Lm(o),x=r.createProgram(),v,p,u=t.glslVersion?"#version "+t.glslVersion+`
`:"";t.isRawShaderMaterial?(v=["#define SHADER_TYPE "+t.shaderType,"#define SHADER_NAME "+t.shaderName,m].filter(po).join(`
`),v.length>0&&(v+=`
`),p=["#define SHADER_TYPE "+t.shaderType,"#define SHADER_NAME "+t.shaderName,m].filter(po).join(`
`),p.length>0&&(p+=`
`)):(v=[kh(t),"#define SHADER_TYPE "+t.shaderType,"#define SHADER_NAME "+t.shaderName,m,t.extensionClipCullDistance?"#define USE_CLIP_DISTANCE":"",t.batching?"#define USE_BATCHING":"",t.batchingColor?"#define USE_BATCHING_COLOR":"",t.instancing?"#define USE_INSTANCING":"",t.instancingColor?"#define USE_INSTANCING_COLOR":"",t.instancingMorph?"#define USE_INSTANCING_MORPH":"",t.useFog&&t.fog?"#define USE_FOG":"",t.useFog&&t.fogExp2?"#define FOG_EXP2":"",t.map?"#define USE_MAP":"",t.envMap?"#define USE_ENVMAP":"",t.envMap?"#define "+f:"",t.lightMap?"#define USE_LIGHTMAP":"",t.aoMap?"#define USE_AOMAP":"",t.bumpMap?"#define USE_BUMPMAP":"",t.normalMap?"#define USE_NORMALMAP":"",t.normalMapObjectSpace?"#define USE_NORMALMAP_OBJECTSPACE":"",t.normalMapTangentSpace?"#define USE_NORMALMAP_TANGENTSPACE":"",t.displacementMap?"#define USE_DISPLACEMENTMAP":"",t.emissiveMap?"#define USE_EMISSIVEMAP":"",t.anisotropy?"#define USE_ANISOTROPY":"",t.anisotropyMap?"#define USE_ANISOTROPYMAP":"",t.clearcoatMap?"#define USE_CLEARCOATMAP":"",t.clearcoatRoughnessMap?"#define USE_CLEARCOAT_ROUGHNESSMAP":"",t.clearcoatNormalMap?"#define USE_CLEARCOAT_NORMALMAP":"",t.diffuseRoughnessMap?"#define USE_DIFFUSE_ROUGHNESSMAP":"",t.iridescenceMap?"#define USE_IRIDESCENCEMAP":"",t.iridescenceThicknessMap?"#define USE_IRIDESCENCE_THICKNESSMAP":"",t.specularMap?"#define USE_SPECULARMAP":"",t.specularColorMap?"#define USE_SPECULAR_COLORMAP":"",t.specularIntensityMap?"#define USE_SPECULAR_INTENSITYMAP":"",t.roughnessMap?"#define USE_ROUGHNESSMAP":"",t.metalnessMap?"#define USE_METALNESSMAP":"",t.alphaMap?"#define USE_ALPHAMAP":"",t.alphaHash?"#define USE_ALPHAHASH":"",t.transmission?"#define USE_TRANSMISSION":"",t.transmissionMap?"#define USE_TRANSMISSIONMAP":"",t.thicknessMap?"#define USE_THICKNESSMAP":"",t.sheenColorMap?"#define USE_SHEEN_COLORMAP":"",t.sheenRoughnessMap?"#define USE_SHEEN_ROUGHNESSMAP":"",t.mapUv?"#define MAP_UV "+t.mapUv:"",t.alphaMapUv?"#define ALPHAMAP_UV "+t.alphaMapUv:"",t.lightMapUv?"#define LIGHTMAP_UV "+t.lightMapUv:"",t.aoMapUv?"#define AOMAP_UV "+t.aoMapUv:"",t.emissiveMapUv?"#define EMISSIVEMAP_UV "+t.emissiveMapUv:"",t.bumpMapUv?"#define BUMPMAP_UV "+t.bumpMapUv:"",t.normalMapUv?"#define NORMALMAP_UV "+t.normalMapUv:"",t.displacementMapUv?"#define DISPLACEMENTMAP_UV "+t.displacementMapUv:"",t.metalnessMapUv?"#define METALNESSMAP_UV "+t.metalnessMapUv:"",t.roughnessMapUv?"#define ROUGHNESSMAP_UV "+t.roughnessMapUv:"",t.anisotropyMapUv?"#define ANISOTROPYMAP_UV "+t.anisotropyMapUv:"",t.clearcoatMapUv?"#define CLEARCOATMAP_UV "+t.clearcoatMapUv:"",t.clearcoatNormalMapUv?"#define CLEARCOAT_NORMALMAP_UV "+t.clearcoatNormalMapUv:"",t.clearcoatRoughnessMapUv?"#define CLEARCOAT_ROUGHNESSMAP_UV "+t.clearcoatRoughnessMapUv:"",t.diffuseRoughnessMapUv?"#define DIFFUSE_ROUGHNESSMAP_UV "+t.diffuseRoughnessMapUv:"",t.iridescenceMapUv?"#define IRIDESCENCEMAP_UV "+t.iridescenceMapUv:"",t.iridescenceThicknessMapUv?"#define IRIDESCENCE_THICKNESSMAP_UV "+t.iridescenceThicknessMapUv:"",t.sheenColorMapUv?"#define SHEEN_COLORMAP_UV "+t.sheenColorMapUv:"",t.sheenRoughnessMapUv?"#define SHEEN_ROUGHNESSMAP_UV "+t.sheenRoughnessMapUv:"",t.specularMapUv?"#define SPECULARMAP_UV "+t.specularMapUv:"",t.specularColorMapUv?"#define SPECULAR_COLORMAP_UV "+t.specularColorMapUv:"",t.specularIntensityMapUv?"#define SPECULAR_INTENSITYMAP_UV "+t.specularIntensityMapUv:"",t.transmissionMapUv?"#define TRANSMISSIONMAP_UV "+t.transmissionMapUv:"",t.thicknessMapUv?"#define THICKNESSMAP_UV "+t.thicknessMapUv:"",t.vertexTangents&&t.flatShading===!1?"#define USE_TANGENT":"",t.vertexNormals?"#define HAS_NORMAL":"",t.vertexColors?"#define USE_COLOR":"",t.vertexAlphas?"#define USE_COLOR_ALPHA":"",t.vertexUv1s?"#define USE_UV1":"",t.vertexUv2s?"#define USE_UV2":"",t.vertexUv3s?"#define USE_UV3":"",t.pointsUvs?"#define USE_POINTS_UV":"",t.flatShading?"#define FLAT_SHADED":"",t.skinning?"#define USE_SKINNING":"",t.morphTargets?"#define USE_MORPHTARGETS":"",t.morphNormals&&t.flatShading===!1?"#define USE_MORPHNORMALS":"",t.morphColors?"#define USE_MORPHCOLORS":"",t.morphTargetsCount>0?"#define MORPHTARGETS_TEXTURE_STRIDE "+t.morphTextureStride:"",t.morphTargetsCount>0?"#define MORPHTARGETS_COUNT "+t.morphTargetsCount:"",t.doubleSided?"#define DOUBLE_SIDED":"",t.flipSided?"#define FLIP_SIDED":"",t.shadowMapEnabled?"#define USE_SHADOWMAP":"",t.shadowMapEnabled?"#define "+c:"",t.sizeAttenuation?"#define USE_SIZEATTENUATION":"",t.numLightProbes>0?"#define USE_LIGHT_PROBES":"",t.logarithmicDepthBuffer?"#define USE_LOGARITHMIC_DEPTH_BUFFER":"",t.reversedDepthBuffer?"#define USE_REVERSED_DEPTH_BUFFER":"","uniform mat4 modelMatrix;","uniform mat4 modelViewMatrix;","uniform mat4 projectionMatrix;","uniform mat4 viewMatrix;","uniform mat3 normalMatrix;","uniform vec3 cameraPosition;","uniform bool isOrthographic;","#ifdef USE_INSTANCING","	attribute mat4 instanceMatrix;","#endif","#ifdef USE_INSTANCING_COLOR","	attribute vec3 instanceColor;","#endif","#ifdef USE_INSTANCING_MORPH","	uniform sampler2D morphTexture;","#endif","attribute vec3 position;","attribute vec3 normal;","attribute vec2 uv;","#ifdef USE_UV1","	attribute vec2 uv1;","#endif","#ifdef USE_UV2","	attribute vec2 uv2;","#endif","#ifdef USE_UV3","	attribute vec2 uv3;","#endif","#ifdef USE_TANGENT","	attribute vec4 tangent;","#endif","#if defined( USE_COLOR_ALPHA )","	attribute vec4 color;","#elif defined( USE_COLOR )","	attribute vec3 color;","#endif","#ifdef USE_SKINNING","	attribute vec4 skinIndex;","	attribute vec4 skinWeight;","#endif",`
`].filter(po).join(`
`),p=[kh(t),"#define SHADER_TYPE "+t.shaderType,"#define SHADER_NAME "+t.shaderName,m,t.useFog&&t.fog?"#define USE_FOG":"",t.useFog&&t.fogExp2?"#define FOG_EXP2":"",t.alphaToCoverage?"#define ALPHA_TO_COVERAGE":"",t.map?"#define USE_MAP":"",t.matcap?"#define USE_MATCAP":"",t.envMap?"#define USE_ENVMAP":"",t.envMap?"#define "+l:"",t.envMap?"#define "+f:"",t.envMap?"#define "+d:"",t.envMapPMREM?"#define ENVMAP_MAX_LOD "+t.envMapMaxLod+".0":"",t.envMapPMREM?"#define ENVMAP_SIZE "+t.envMapSize+".0":"",t.lightMap?"#define USE_LIGHTMAP":"",t.aoMap?"#define USE_AOMAP":"",t.bumpMap?"#define USE_BUMPMAP":"",t.normalMap?"#define USE_NORMALMAP":"",t.normalMapObjectSpace?"#define USE_NORMALMAP_OBJECTSPACE":"",t.normalMapTangentSpace?"#define USE_NORMALMAP_TANGENTSPACE":"",t.packedNormalMap?"#define USE_PACKED_NORMALMAP":"",t.emissiveMap?"#define USE_EMISSIVEMAP":"",t.anisotropy?"#define USE_ANISOTROPY":"",t.anisotropyMap?"#define USE_ANISOTROPYMAP":"",t.clearcoat?"#define USE_CLEARCOAT":"",t.clearcoatMap?"#define USE_CLEARCOATMAP":"",t.clearcoatRoughnessMap?"#define USE_CLEARCOAT_ROUGHNESSMAP":"",t.clearcoatNormalMap?"#define USE_CLEARCOAT_NORMALMAP":"",t.diffuseRoughness?"#define USE_DIFFUSE_ROUGHNESS":"",t.diffuseRoughnessMap?"#define USE_DIFFUSE_ROUGHNESSMAP":"",t.dispersion?"#define USE_DISPERSION":"",t.retroreflection?"#define USE_RETROREFLECTION":"",t.iridescence?"#define USE_IRIDESCENCE":"",t.iridescenceMap?"#define USE_IRIDESCENCEMAP":"",t.iridescenceThicknessMap?"#define USE_IRIDESCENCE_THICKNESSMAP":"",t.specularMap?"#define USE_SPECULARMAP":"",t.specularColorMap?"#define USE_SPECULAR_COLORMAP":"",t.specularIntensityMap?"#define USE_SPECULAR_INTENSITYMAP":"",t.roughnessMap?"#define USE_ROUGHNESSMAP":"",t.metalnessMap?"#define USE_METALNESSMAP":"",t.alphaMap?"#define USE_ALPHAMAP":"",t.alphaTest?"#define USE_ALPHATEST":"",t.alphaHash?"#define USE_ALPHAHASH":"",t.sheen?"#define USE_SHEEN":"",t.sheenColorMap?"#define USE_SHEEN_COLORMAP":"",t.sheenRoughnessMap?"#define USE_SHEEN_ROUGHNESSMAP":"",t.transmission?"#define USE_TRANSMISSION":"",t.transmissionMap?"#define USE_TRANSMISSIONMAP":"",t.thicknessMap?"#define USE_THICKNESSMAP":"",t.vertexTangents&&t.flatShading===!1?"#define USE_TANGENT":"",t.vertexColors||t.instancingColor?"#define USE_COLOR":"",t.vertexAlphas||t.batchingColor?"#define USE_COLOR_ALPHA":"",t.vertexUv1s?"#define USE_UV1":"",t.vertexUv2s?"#define USE_UV2":"",t.vertexUv3s?"#define USE_UV3":"",t.pointsUvs?"#define USE_POINTS_UV":"",t.gradientMap?"#define USE_GRADIENTMAP":"",t.flatShading?"#define FLAT_SHADED":"",t.doubleSided?"#define DOUBLE_SIDED":"",t.flipSided?"#define FLIP_SIDED":"",t.shadowMapEnabled?"#define USE_SHADOWMAP":"",t.shadowMapEnabled?"#define "+c:"",t.premultipliedAlpha?"#define PREMULTIPLIED_ALPHA":"",t.numLightProbes>0?"#define USE_LIGHT_PROBES":"",t.decodeVideoTexture?"#define DECODE_VIDEO_TEXTURE":"",t.decodeVideoTextureEmissive?"#define DECODE_VIDEO_TEXTURE_EMISSIVE":"",t.logarithmicDepthBuffer?"#define USE_LOGARITHMIC_DEPTH_BUFFER":"",t.reversedDepthBuffer?"#define USE_REVERSED_DEPTH_BUFFER":"","uniform mat4 viewMatrix;","uniform vec3 cameraPosition;","uniform bool isOrthographic;",t.toneMapping!==Xt?"#define TONE_MAPPING":"",t.toneMapping!==Xt?Ie.tonemapping_pars_fragment:"",t.toneMapping!==Xt?wm("toneMapping",t.toneMapping):"",t.dithering?"#define DITHERING":"",t.opaque?"#define OPAQUE":"",Ie.colorspace_pars_fragment,bm("linearToOutputTexel",t.outputColorSpace),Cm(),t.useDepthPacking?"#define DEPTH_PACKING "+t.depthPacking:"",`
`].filter(po).join(`
`)),s=Va(s),s=zh(s,t),s=Hh(s,t),a=Va(a),a=zh(a,t),a=Hh(a,t),s=Vh(s),a=Vh(a),t.isRawShaderMaterial!==!0&&(u=`#version 300 es
`,v=[h,"#define attribute in","#define varying out","#define texture2D texture"].join(`
`)+`
`+v,p=["#define varying in",t.glslVersion===na?"":"layout(location = 0) out highp vec4 pc_fragColor;",t.glslVersion===na?"":"#define gl_FragColor pc_fragColor","#define gl_FragDepthEXT gl_FragDepth","#define texture2D texture","#define textureCube texture","#define texture2DProj textureProj","#define texture2DLodEXT textureLod","#define texture2DProjLodEXT textureProjLod","#define textureCubeLodEXT textureLod","#define texture2DGradEXT textureGrad","#define texture2DProjGradEXT textureProjGrad","#define textureCubeGradEXT textureGrad"].join(`
`)+`
`+p);let y=u+v+s,A=u+p+a,M=Ha(r,r.VERTEX_SHADER,y),C=Ha(r,r.FRAGMENT_SHADER,A);r.attachShader(x,M),r.attachShader(x,C),t.index0AttributeName!==void 0?r.bindAttribLocation(x,0,t.index0AttributeName):t.hasPositionAttribute===!0&&r.bindAttribLocation(x,0,"position"),r.linkProgram(x);function b(D){if(n.debug.checkShaderErrors){let U=r.getProgramInfoLog(x)||"",z=r.getShaderInfoLog(M)||"",$=r.getShaderInfoLog(C)||"",P=U.trim(),W=z.trim(),K=$.trim(),H=!0,te=!0;if(r.getProgramParameter(x,r.LINK_STATUS)===!1)if(H=!1,typeof n.debug.onShaderError=="function")n.debug.onShaderError(r,x,M,C);else{let k=Gh(r,M,"vertex"),J=Gh(r,C,"fragment");Oe("WebGLProgram: Shader Error "+r.getError()+" - VALIDATE_STATUS "+r.getProgramParameter(x,r.VALIDATE_STATUS)+`

Material Name: `+D.name+`
Material Type: `+D.type+`

Program Info Log: `+P+`
`+k+`
`+J)}else P!==""?pe("WebGLProgram: Program Info Log:",P):(W===""||K==="")&&(te=!1);te&&(D.diagnostics={runnable:H,programLog:P,vertexShader:{log:W,prefix:v},fragmentShader:{log:K,prefix:p}})}r.deleteShader(M),r.deleteShader(C),g=new Qi(r,x),T=Dm(r,x)}let g;this.getUniforms=function(){return g===void 0&&b(this),g};let T;this.getAttributes=function(){return T===void 0&&b(this),T};let B=t.rendererExtensionParallelShaderCompile===!1;return this.isReady=function(){return B===!1&&(B=r.getProgramParameter(x,Em)),B},this.destroy=function(){i.releaseStatesOfProgram(this),r.deleteProgram(x),this.program=void 0},this.type=t.shaderType,this.name=t.shaderName,this.id=Tm++,this.cacheKey=e,this.usedTimes=1,this.program=x,this.vertexShader=M,this.fragmentShader=C,this}var km=0,Ys=class{constructor(){this.shaderCache=new Map,this.materialCache=new Map}update(e,t,i){let r=this._getShaderCacheForMaterial(e);return r.has(t)===!1&&(r.add(t),t.usedTimes++),r.has(i)===!1&&(r.add(i),i.usedTimes++),this}remove(e){let t=this.materialCache.get(e);for(let i of t)i.usedTimes--,i.usedTimes===0&&this.shaderCache.delete(i.code);return this.materialCache.delete(e),this}getVertexShaderStage(e){return this._getShaderStage(e.vertexShader)}getFragmentShaderStage(e){return this._getShaderStage(e.fragmentShader)}dispose(){this.shaderCache.clear(),this.materialCache.clear()}_getShaderCacheForMaterial(e){let t=this.materialCache,i=t.get(e);return i===void 0&&(i=new Set,t.set(e,i)),i}_getShaderStage(e){let t=this.shaderCache,i=t.get(e);return i===void 0&&(i=new ka(e),t.set(e,i)),i}},ka=class{constructor(e){this.id=km++,this.code=e,this.usedTimes=0}};function Wm(n){return n===jt||n===sn||n===an}function Xh(n,e,t,i,r,o){let s=new On,a=new Ys,c=new Set,l=[],f=new Map,d=i.logarithmicDepthBuffer,h={MeshDepthMaterial:"depth",MeshDistanceMaterial:"distance",MeshNormalMaterial:"normal",MeshBasicMaterial:"basic",MeshLambertMaterial:"lambert",MeshPhongMaterial:"phong",MeshToonMaterial:"toon",MeshStandardMaterial:"physical",MeshPhysicalMaterial:"physical",MeshMatcapMaterial:"matcap",LineBasicMaterial:"basic",LineDashedMaterial:"dashed",PointsMaterial:"points",ShadowMaterial:"shadow",SpriteMaterial:"sprite"};function m(g){return c.add(g),g===0?"uv":`uv${g}`}function x(g,T,B,D,U,z){let $=D.fog,P=U.geometry,W=g.isMeshStandardMaterial||g.isMeshLambertMaterial||g.isMeshPhongMaterial?D.environment:null,K=g.isMeshStandardMaterial||g.isMeshLambertMaterial&&!g.envMap||g.isMeshPhongMaterial&&!g.envMap,H=e.get(g.envMap||W,K),te=h[g.type],k=i.precision;g.precision!==null&&(k=i.getMaxPrecision(g.precision),k!==g.precision&&pe("WebGLProgram.getParameters:",g.precision,"not supported, using",k,"instead."));let J=P.morphAttributes.position||P.morphAttributes.normal||P.morphAttributes.color,Q=J!==void 0?J.length:0,Se=0;P.morphAttributes.position!==void 0&&(Se=1),P.morphAttributes.normal!==void 0&&(Se=2),P.morphAttributes.color!==void 0&&(Se=3);let Ne,Fe,Qe,Ye;if(te){let he=hi[te];Ne=he.vertexShader,Fe=he.fragmentShader}else{Ne=g.vertexShader,Fe=g.fragmentShader;let he=a.getVertexShaderStage(g),qe=a.getFragmentShaderStage(g);a.update(g,he,qe),Qe=he.id,Ye=qe.id}let Ze=n.getRenderTarget(),Te=n.state.buffers.depth.getReversed(),Ke=U.isInstancedMesh===!0,pt=U.isBatchedMesh===!0,Ve=!!g.map,mt=!!g.matcap,Gt=!!H,bt=Gt&&H.isPMREMTexture===!0,Qt=!!g.aoMap,gt=!!g.lightMap,kt=!!g.bumpMap&&g.wireframe===!1,rt=!!g.normalMap,Ti=!!g.displacementMap,Mt=!!g.emissiveMap,ri=!!g.metalnessMap,oi=!!g.roughnessMap,si=g.anisotropy>0,L=g.clearcoat>0,ai=g.diffuseRoughness>0,tt=g.dispersion>0,it=g.retroreflectivity>0,fe=g.iridescence>0,_t=g.sheen>0,be=g.transmission>0,Ce=si&&!!g.anisotropyMap,E=L&&!!g.clearcoatMap,_=L&&!!g.clearcoatNormalMap,F=L&&!!g.clearcoatRoughnessMap,j=ai&&!!g.diffuseRoughnessMap,Z=fe&&!!g.iridescenceMap,ne=fe&&!!g.iridescenceThicknessMap,le=_t&&!!g.sheenColorMap,X=_t&&!!g.sheenRoughnessMap,q=!!g.specularMap,oe=!!g.specularColorMap,R=!!g.specularIntensityMap,Y=be&&!!g.transmissionMap,V=be&&!!g.thicknessMap,se=!!g.gradientMap,ie=!!g.alphaMap,re=g.alphaTest>0,ve=!!g.alphaHash,Ue=!!g.extensions,ee=Xt;g.toneMapped&&(Ze===null||Ze.isXRRenderTarget===!0)&&(ee=n.toneMapping);let Ae=bt?H.isCompressedCubeTexture?H.image[0].mipmaps:H.mipmaps:null,De={shaderID:te,shaderType:g.type,shaderName:g.name,vertexShader:Ne,fragmentShader:Fe,defines:g.defines,customVertexShaderID:Qe,customFragmentShaderID:Ye,isRawShaderMaterial:g.isRawShaderMaterial===!0,glslVersion:g.glslVersion,precision:k,batching:pt,batchingColor:pt&&U._colorsTexture!==null,instancing:Ke,instancingColor:Ke&&U.instanceColor!==null,instancingMorph:Ke&&U.morphTexture!==null,outputColorSpace:Ze===null?n.outputColorSpace:Ze.isXRRenderTarget===!0?Ze.texture.colorSpace:Re.workingColorSpace,alphaToCoverage:!!g.alphaToCoverage,map:Ve,matcap:mt,envMap:Gt,envMapMode:Gt&&H.mapping,envMapPMREM:bt,envMapMaxLod:bt?Ae.length-1:null,envMapSize:bt?Ae[0].width:null,aoMap:Qt,lightMap:gt,bumpMap:kt,normalMap:rt,displacementMap:Ti,emissiveMap:Mt,normalMapObjectSpace:rt&&g.normalMapType===Rl,normalMapTangentSpace:rt&&g.normalMapType===ln,packedNormalMap:rt&&g.normalMapType===ln&&Wm(g.normalMap.format),metalnessMap:ri,roughnessMap:oi,anisotropy:si,anisotropyMap:Ce,clearcoat:L,clearcoatMap:E,clearcoatNormalMap:_,clearcoatRoughnessMap:F,diffuseRoughness:ai,diffuseRoughnessMap:j,dispersion:tt,retroreflection:it,iridescence:fe,iridescenceMap:Z,iridescenceThicknessMap:ne,sheen:_t,sheenColorMap:le,sheenRoughnessMap:X,specularMap:q,specularColorMap:oe,specularIntensityMap:R,transmission:be,transmissionMap:Y,thicknessMap:V,gradientMap:se,opaque:g.transparent===!1&&g.blending===zi&&g.alphaToCoverage===!1,alphaMap:ie,alphaTest:re,alphaHash:ve,combine:g.combine,mapUv:Ve&&m(g.map.channel),aoMapUv:Qt&&m(g.aoMap.channel),lightMapUv:gt&&m(g.lightMap.channel),bumpMapUv:kt&&m(g.bumpMap.channel),normalMapUv:rt&&m(g.normalMap.channel),displacementMapUv:Ti&&m(g.displacementMap.channel),emissiveMapUv:Mt&&m(g.emissiveMap.channel),metalnessMapUv:ri&&m(g.metalnessMap.channel),roughnessMapUv:oi&&m(g.roughnessMap.channel),anisotropyMapUv:Ce&&m(g.anisotropyMap.channel),clearcoatMapUv:E&&m(g.clearcoatMap.channel),clearcoatNormalMapUv:_&&m(g.clearcoatNormalMap.channel),clearcoatRoughnessMapUv:F&&m(g.clearcoatRoughnessMap.channel),diffuseRoughnessMapUv:j&&m(g.diffuseRoughnessMap.channel),iridescenceMapUv:Z&&m(g.iridescenceMap.channel),iridescenceThicknessMapUv:ne&&m(g.iridescenceThicknessMap.channel),sheenColorMapUv:le&&m(g.sheenColorMap.channel),sheenRoughnessMapUv:X&&m(g.sheenRoughnessMap.channel),specularMapUv:q&&m(g.specularMap.channel),specularColorMapUv:oe&&m(g.specularColorMap.channel),specularIntensityMapUv:R&&m(g.specularIntensityMap.channel),transmissionMapUv:Y&&m(g.transmissionMap.channel),thicknessMapUv:V&&m(g.thicknessMap.channel),alphaMapUv:ie&&m(g.alphaMap.channel),vertexTangents:!!P.attributes.tangent&&(rt||si),vertexNormals:!!P.attributes.normal,vertexColors:g.vertexColors,vertexAlphas:g.vertexColors===!0&&!!P.attributes.color&&P.attributes.color.itemSize===4,pointsUvs:U.isPoints===!0&&!!P.attributes.uv&&(Ve||ie),fog:!!$,useFog:g.fog===!0,fogExp2:!!$&&$.isFogExp2,flatShading:g.wireframe===!1&&(g.flatShading===!0||P.attributes.normal===void 0&&rt===!1&&(g.isMeshLambertMaterial||g.isMeshPhongMaterial||g.isMeshStandardMaterial||g.isMeshPhysicalMaterial)),sizeAttenuation:g.sizeAttenuation===!0,logarithmicDepthBuffer:d,reversedDepthBuffer:Te,skinning:U.isSkinnedMesh===!0,hasPositionAttribute:P.attributes.position!==void 0,morphTargets:P.morphAttributes.position!==void 0,morphNormals:P.morphAttributes.normal!==void 0,morphColors:P.morphAttributes.color!==void 0,morphTargetsCount:Q,morphTextureStride:Se,numSunLights:T.sun.length,numDirLights:T.directional.length,numPointLights:T.point.length,numSpotLights:T.spot.length,numSpotLightMaps:T.spotLightMap.length,numRectAreaLights:T.rectArea.length,numHemiLights:T.hemi.length,numSunLightShadows:T.sunShadowMap.length,numDirLightShadows:T.directionalShadowMap.length,numPointLightShadows:T.pointShadowMap.length,numSpotLightShadows:T.spotShadowMap.length,numSpotLightShadowsWithMaps:T.numSpotLightShadowsWithMaps,numLightProbes:T.numLightProbes,numLightProbeGrids:z.filter(he=>he.texture!==null).length,numClippingPlanes:o.numPlanes,numClipIntersection:o.numIntersection,dithering:g.dithering,shadowMapEnabled:n.shadowMap.enabled&&B.length>0,shadowMapType:n.shadowMap.type,toneMapping:ee,decodeVideoTexture:Ve&&g.map.isVideoTexture===!0&&Re.getTransfer(g.map.colorSpace)===ze,decodeVideoTextureEmissive:Mt&&g.emissiveMap.isVideoTexture===!0&&Re.getTransfer(g.emissiveMap.colorSpace)===ze,premultipliedAlpha:g.premultipliedAlpha,doubleSided:g.side===Wt,flipSided:g.side===at,useDepthPacking:g.depthPacking>=0,depthPacking:g.depthPacking||0,index0AttributeName:g.index0AttributeName,extensionClipCullDistance:Ue&&g.extensions.clipCullDistance===!0&&t.has("WEBGL_clip_cull_distance"),extensionMultiDraw:(Ue&&g.extensions.multiDraw===!0||pt)&&t.has("WEBGL_multi_draw"),rendererExtensionParallelShaderCompile:t.has("KHR_parallel_shader_compile"),customProgramCacheKey:g.customProgramCacheKey()};return De.vertexUv1s=c.has(1),De.vertexUv2s=c.has(2),De.vertexUv3s=c.has(3),c.clear(),De}function v(g){let T=[];if(g.shaderID?T.push(g.shaderID):(T.push(g.customVertexShaderID),T.push(g.customFragmentShaderID)),g.defines!==void 0)for(let B in g.defines)T.push(B),T.push(g.defines[B]);return g.isRawShaderMaterial===!1&&(p(T,g),u(T,g),T.push(n.outputColorSpace)),T.push(g.customProgramCacheKey),T.join()}function p(g,T){g.push(T.precision),g.push(T.outputColorSpace),g.push(T.envMapMode),g.push(T.envMapPMREM),g.push(T.envMapMaxLod),g.push(T.envMapSize),g.push(T.mapUv),g.push(T.alphaMapUv),g.push(T.lightMapUv),g.push(T.aoMapUv),g.push(T.bumpMapUv),g.push(T.normalMapUv),g.push(T.displacementMapUv),g.push(T.emissiveMapUv),g.push(T.metalnessMapUv),g.push(T.roughnessMapUv),g.push(T.anisotropyMapUv),g.push(T.clearcoatMapUv),g.push(T.clearcoatNormalMapUv),g.push(T.clearcoatRoughnessMapUv),g.push(T.diffuseRoughnessMapUv),g.push(T.iridescenceMapUv),g.push(T.iridescenceThicknessMapUv),g.push(T.sheenColorMapUv),g.push(T.sheenRoughnessMapUv),g.push(T.specularMapUv),g.push(T.specularColorMapUv),g.push(T.specularIntensityMapUv),g.push(T.transmissionMapUv),g.push(T.thicknessMapUv),g.push(T.combine),g.push(T.fogExp2),g.push(T.sizeAttenuation),g.push(T.morphTargetsCount),g.push(T.numSunLights),g.push(T.numDirLights),g.push(T.numPointLights),g.push(T.numSpotLights),g.push(T.numSpotLightMaps),g.push(T.numHemiLights),g.push(T.numRectAreaLights),g.push(T.numSunLightShadows),g.push(T.numDirLightShadows),g.push(T.numPointLightShadows),g.push(T.numSpotLightShadows),g.push(T.numSpotLightShadowsWithMaps),g.push(T.numLightProbes),g.push(T.numLightProbeGrids),g.push(T.shadowMapType),g.push(T.toneMapping),g.push(T.numClippingPlanes),g.push(T.numClipIntersection),g.push(T.depthPacking)}function u(g,T){s.disableAll(),T.instancing&&s.enable(0),T.instancingColor&&s.enable(1),T.instancingMorph&&s.enable(2),T.matcap&&s.enable(3),T.envMap&&s.enable(4),T.normalMapObjectSpace&&s.enable(5),T.normalMapTangentSpace&&s.enable(6),T.clearcoat&&s.enable(7),T.iridescence&&s.enable(8),T.alphaTest&&s.enable(9),T.vertexColors&&s.enable(10),T.vertexAlphas&&s.enable(11),T.vertexUv1s&&s.enable(12),T.vertexUv2s&&s.enable(13),T.vertexUv3s&&s.enable(14),T.vertexTangents&&s.enable(15),T.anisotropy&&s.enable(16),T.alphaHash&&s.enable(17),T.batching&&s.enable(18),T.dispersion&&s.enable(19),T.retroreflection&&s.enable(24),T.diffuseRoughness&&s.enable(25),T.batchingColor&&s.enable(20),T.gradientMap&&s.enable(21),T.packedNormalMap&&s.enable(22),T.vertexNormals&&s.enable(23),g.push(s.mask),s.disableAll(),T.fog&&s.enable(0),T.useFog&&s.enable(1),T.flatShading&&s.enable(2),T.logarithmicDepthBuffer&&s.enable(3),T.reversedDepthBuffer&&s.enable(4),T.skinning&&s.enable(5),T.morphTargets&&s.enable(6),T.morphNormals&&s.enable(7),T.morphColors&&s.enable(8),T.premultipliedAlpha&&s.enable(9),T.shadowMapEnabled&&s.enable(10),T.doubleSided&&s.enable(11),T.flipSided&&s.enable(12),T.useDepthPacking&&s.enable(13),T.dithering&&s.enable(14),T.transmission&&s.enable(15),T.sheen&&s.enable(16),T.opaque&&s.enable(17),T.pointsUvs&&s.enable(18),T.decodeVideoTexture&&s.enable(19),T.decodeVideoTextureEmissive&&s.enable(20),T.alphaToCoverage&&s.enable(21),T.numLightProbeGrids>0&&s.enable(22),T.hasPositionAttribute&&s.enable(23),g.push(s.mask)}function y(g){let T=h[g.type],B;if(T){let D=hi[T];B=Ec.clone(D.uniforms)}else B=g.uniforms;return B}function A(g,T){let B=f.get(T);return B!==void 0?++B.usedTimes:(B=new Wh(n,T,g,r),l.push(B),f.set(T,B)),B}function M(g){if(--g.usedTimes===0){let T=l.indexOf(g);l[T]=l[l.length-1],l.pop(),f.delete(g.cacheKey),g.destroy()}}function C(g){a.remove(g)}function b(){a.dispose()}return{getParameters:x,getProgramCacheKey:v,getUniforms:y,acquireProgram:A,releaseProgram:M,releaseShaderCache:C,programs:l,dispose:b}}function qh(){let n=new WeakMap;function e(s){return n.has(s)}function t(s){let a=n.get(s);return a===void 0&&(a={},n.set(s,a)),a}function i(s){n.delete(s)}function r(s,a,c){n.get(s)[a]=c}function o(){n=new WeakMap}return{has:e,get:t,remove:i,update:r,dispose:o}}function Xm(n,e){return n.groupOrder!==e.groupOrder?n.groupOrder-e.groupOrder:n.renderOrder!==e.renderOrder?n.renderOrder-e.renderOrder:n.material.id!==e.material.id?n.material.id-e.material.id:n.materialVariant!==e.materialVariant?n.materialVariant-e.materialVariant:n.z!==e.z?n.z-e.z:n.id-e.id}function Yh(n,e){return n.groupOrder!==e.groupOrder?n.groupOrder-e.groupOrder:n.renderOrder!==e.renderOrder?n.renderOrder-e.renderOrder:n.z!==e.z?e.z-n.z:n.id-e.id}function Zh(){let n=[],e=0,t=[],i=[],r=[];function o(){e=0,t.length=0,i.length=0,r.length=0}function s(h){let m=0;return h.isInstancedMesh&&(m+=2),h.isSkinnedMesh&&(m+=1),m}function a(h,m,x,v,p,u){let y=n[e];return y===void 0?(y={id:h.id,object:h,geometry:m,material:x,materialVariant:s(h),groupOrder:v,renderOrder:h.renderOrder,z:p,group:u},n[e]=y):(y.id=h.id,y.object=h,y.geometry=m,y.material=x,y.materialVariant=s(h),y.groupOrder=v,y.renderOrder=h.renderOrder,y.z=p,y.group=u),e++,y}function c(h,m,x,v,p,u,y){y.reversedDepth===!0&&(p=-p);let A=a(h,m,x,v,p,u);x.transmission>0?i.push(A):x.transparent===!0?r.push(A):t.push(A)}function l(h,m,x,v,p,u){let y=a(h,m,x,v,p,u);x.transmission>0?i.unshift(y):x.transparent===!0?r.unshift(y):t.unshift(y)}function f(h,m){t.length>1&&t.sort(h||Xm),i.length>1&&i.sort(m||Yh),r.length>1&&r.sort(m||Yh)}function d(){for(let h=e,m=n.length;h<m;h++){let x=n[h];if(x.id===null)break;x.id=null,x.object=null,x.geometry=null,x.material=null,x.group=null}}return{opaque:t,transmissive:i,transparent:r,init:o,push:c,unshift:l,finish:d,sort:f}}function Kh(){let n=new WeakMap;function e(i,r){let o=n.get(i),s;return o===void 0?(s=new Zh,n.set(i,[s])):r>=o.length?(s=new Zh,o.push(s)):s=o[r],s}function t(){n=new WeakMap}return{get:e,dispose:t}}function qm(){let n={};return{get:function(e){if(n[e.id]!==void 0)return n[e.id];let t;switch(e.type){case"SunLight":case"DirectionalLight":t={direction:new I,color:new Me};break;case"SpotLight":t={position:new I,direction:new I,color:new Me,distance:0,coneCos:0,penumbraCos:0,decay:0};break;case"PointLight":t={position:new I,color:new Me,distance:0,decay:0};break;case"HemisphereLight":t={direction:new I,skyColor:new Me,groundColor:new Me};break;case"RectAreaLight":t={color:new Me,position:new I,halfWidth:new I,halfHeight:new I};break}return n[e.id]=t,t}}}function Ym(){let n={};return{get:function(e){if(n[e.id]!==void 0)return n[e.id];let t;switch(e.type){case"SunLight":case"DirectionalLight":t={shadowIntensity:1,shadowBias:0,shadowNormalBias:0,shadowRadius:1,shadowMapSize:new ye};break;case"SpotLight":t={shadowIntensity:1,shadowBias:0,shadowNormalBias:0,shadowRadius:1,shadowMapSize:new ye};break;case"PointLight":t={shadowIntensity:1,shadowBias:0,shadowNormalBias:0,shadowRadius:1,shadowMapSize:new ye,shadowCameraNear:1,shadowCameraFar:1e3};break}return n[e.id]=t,t}}}var Zm=0;function Km(n,e){return(e.castShadow?2:0)-(n.castShadow?2:0)+(e.map?1:0)-(n.map?1:0)}function Jh(n){let e=new qm,t=Ym(),i={version:0,hash:{sunLength:-1,directionalLength:-1,pointLength:-1,spotLength:-1,rectAreaLength:-1,hemiLength:-1,numSunShadows:-1,numDirectionalShadows:-1,numPointShadows:-1,numSpotShadows:-1,numSpotMaps:-1,numLightProbes:-1},ambient:[0,0,0],probe:[],sun:[],sunShadow:[],sunShadowMap:[],sunShadowMatrix:[],sunShadowCascade:[],directional:[],directionalShadow:[],directionalShadowMap:[],directionalShadowMatrix:[],spot:[],spotLightMap:[],spotShadow:[],spotShadowMap:[],spotLightMatrix:[],rectArea:[],rectAreaLTC1:null,rectAreaLTC2:null,point:[],pointShadow:[],pointShadowMap:[],pointShadowMatrix:[],hemi:[],numSpotLightShadowsWithMaps:0,numLightProbes:0};for(let l=0;l<9;l++)i.probe.push(new I);let r=new I,o=new we,s=new we;function a(l){let f=0,d=0,h=0;for(let z=0;z<9;z++)i.probe[z].set(0,0,0);let m=0,x=0,v=0,p=0,u=0,y=0,A=0,M=0,C=0,b=0,g=0,T=0,B=0,D=0;l.sort(Km);for(let z=0,$=l.length;z<$;z++){let P=l[z],W=P.color,K=P.intensity,H=P.distance,te=null;if(P.shadow&&P.shadow.map&&(P.shadow.map.texture.format===jt?te=P.shadow.map.texture:te=P.shadow.map.depthTexture||P.shadow.map.texture),P.isAmbientLight)f+=W.r*K,d+=W.g*K,h+=W.b*K;else if(P.isLightProbe){for(let k=0;k<9;k++)i.probe[k].addScaledVector(P.sh.coefficients[k],K);D++}else if(P.isSunLight){let k=e.get(P);if(k.color.copy(P.color).multiplyScalar(P.intensity),P.castShadow){let J=P.shadow,Q=t.get(P);Q.shadowIntensity=J.intensity,Q.shadowBias=J.bias,Q.shadowNormalBias=J.normalBias,Q.shadowRadius=J.radius,Q.shadowMapSize.copy(J.mapSize).multiply(J.getFrameExtents()),i.sunShadow[x]=Q,i.sunShadowMap[x]=te;let Se=J.getViewportCount();for(let Ne=0;Ne<Se;Ne++)i.sunShadowMatrix[v+Ne]=J.getMatrix(Ne),i.sunShadowCascade[v+Ne]=J._cascadeData[Ne];v+=Se,x++}i.sun[m]=k,m++}else if(P.isDirectionalLight){let k=e.get(P);if(k.color.copy(P.color).multiplyScalar(P.intensity),P.castShadow){let J=P.shadow,Q=t.get(P);Q.shadowIntensity=J.intensity,Q.shadowBias=J.bias,Q.shadowNormalBias=J.normalBias,Q.shadowRadius=J.radius,Q.shadowMapSize=J.mapSize,i.directionalShadow[p]=Q,i.directionalShadowMap[p]=te,i.directionalShadowMatrix[p]=P.shadow.matrix,C++}i.directional[p]=k,p++}else if(P.isSpotLight){let k=e.get(P);k.position.setFromMatrixPosition(P.matrixWorld),k.color.copy(W).multiplyScalar(K),k.distance=H,k.coneCos=Math.cos(P.angle),k.penumbraCos=Math.cos(P.angle*(1-P.penumbra)),k.decay=P.decay,i.spot[y]=k;let J=P.shadow;if(P.map&&(i.spotLightMap[T]=P.map,T++,J.updateMatrices(P),P.castShadow&&B++),i.spotLightMatrix[y]=J.matrix,P.castShadow){let Q=t.get(P);Q.shadowIntensity=J.intensity,Q.shadowBias=J.bias,Q.shadowNormalBias=J.normalBias,Q.shadowRadius=J.radius,Q.shadowMapSize=J.mapSize,i.spotShadow[y]=Q,i.spotShadowMap[y]=te,g++}y++}else if(P.isRectAreaLight){let k=e.get(P);k.color.copy(W).multiplyScalar(K),k.halfWidth.set(P.width*.5,0,0),k.halfHeight.set(0,P.height*.5,0),i.rectArea[A]=k,A++}else if(P.isPointLight){let k=e.get(P);if(k.color.copy(P.color).multiplyScalar(P.intensity),k.distance=P.distance,k.decay=P.decay,P.castShadow){let J=P.shadow,Q=t.get(P);Q.shadowIntensity=J.intensity,Q.shadowBias=J.bias,Q.shadowNormalBias=J.normalBias,Q.shadowRadius=J.radius,Q.shadowMapSize=J.mapSize,Q.shadowCameraNear=J.camera.near,Q.shadowCameraFar=J.camera.far,i.pointShadow[u]=Q,i.pointShadowMap[u]=te,i.pointShadowMatrix[u]=P.shadow.matrix,b++}i.point[u]=k,u++}else if(P.isHemisphereLight){let k=e.get(P);k.skyColor.copy(P.color).multiplyScalar(K),k.groundColor.copy(P.groundColor).multiplyScalar(K),i.hemi[M]=k,M++}}A>0&&(n.has("OES_texture_float_linear")===!0?(i.rectAreaLTC1=ue.LTC_FLOAT_1,i.rectAreaLTC2=ue.LTC_FLOAT_2):(i.rectAreaLTC1=ue.LTC_HALF_1,i.rectAreaLTC2=ue.LTC_HALF_2)),i.ambient[0]=f,i.ambient[1]=d,i.ambient[2]=h;let U=i.hash;(U.sunLength!==m||U.directionalLength!==p||U.pointLength!==u||U.spotLength!==y||U.rectAreaLength!==A||U.hemiLength!==M||U.numSunShadows!==x||U.numDirectionalShadows!==C||U.numPointShadows!==b||U.numSpotShadows!==g||U.numSpotMaps!==T||U.numLightProbes!==D)&&(i.sun.length=m,i.directional.length=p,i.spot.length=y,i.rectArea.length=A,i.point.length=u,i.hemi.length=M,i.sunShadow.length=x,i.sunShadowMap.length=x,i.sunShadowMatrix.length=v,i.sunShadowCascade.length=v,i.directionalShadow.length=C,i.directionalShadowMap.length=C,i.directionalShadowMatrix.length=C,i.pointShadow.length=b,i.pointShadowMap.length=b,i.pointShadowMatrix.length=b,i.spotShadow.length=g,i.spotShadowMap.length=g,i.spotLightMatrix.length=g+T-B,i.spotLightMap.length=T,i.numSpotLightShadowsWithMaps=B,i.numLightProbes=D,U.sunLength=m,U.directionalLength=p,U.pointLength=u,U.spotLength=y,U.rectAreaLength=A,U.hemiLength=M,U.numSunShadows=x,U.numDirectionalShadows=C,U.numPointShadows=b,U.numSpotShadows=g,U.numSpotMaps=T,U.numLightProbes=D,i.version=Zm++)}function c(l,f){let d=0,h=0,m=0,x=0,v=0,p=0,u=f.matrixWorldInverse;for(let y=0,A=l.length;y<A;y++){let M=l[y];if(M.isSunLight){let C=i.sun[d];C.direction.setFromMatrixPosition(M.matrixWorld),C.direction.transformDirection(u),d++}else if(M.isDirectionalLight){let C=i.directional[h];C.direction.setFromMatrixPosition(M.matrixWorld),r.setFromMatrixPosition(M.target.matrixWorld),C.direction.sub(r),C.direction.transformDirection(u),h++}else if(M.isSpotLight){let C=i.spot[x];C.position.setFromMatrixPosition(M.matrixWorld),C.position.applyMatrix4(u),C.direction.setFromMatrixPosition(M.matrixWorld),r.setFromMatrixPosition(M.target.matrixWorld),C.direction.sub(r),C.direction.transformDirection(u),x++}else if(M.isRectAreaLight){let C=i.rectArea[v];C.position.setFromMatrixPosition(M.matrixWorld),C.position.applyMatrix4(u),s.identity(),o.copy(M.matrixWorld),o.premultiply(u),s.extractRotation(o),C.halfWidth.set(M.width*.5,0,0),C.halfHeight.set(0,M.height*.5,0),C.halfWidth.applyMatrix4(s),C.halfHeight.applyMatrix4(s),v++}else if(M.isPointLight){let C=i.point[m];C.position.setFromMatrixPosition(M.matrixWorld),C.position.applyMatrix4(u),m++}else if(M.isHemisphereLight){let C=i.hemi[p];C.direction.setFromMatrixPosition(M.matrixWorld),C.direction.transformDirection(u),p++}}}return{setup:a,setupView:c,state:i}}function $h(n){let e=new Jh(n),t=[],i=[],r=[];function o(d){f.camera=d,t.length=0,i.length=0,r.length=0}function s(d){d.isLightProbeGrid?r.push(d):t.push(d)}function a(d){i.push(d)}function c(){e.setup(t),r.sort((d,h)=>d.priority-h.priority||d.id-h.id)}function l(d){e.setupView(t,d)}let f={lightsArray:t,shadowsArray:i,lightProbeGridArray:r,camera:null,lights:e,transmissionRenderTarget:{},textureUnits:0};return{init:o,state:f,setupLights:c,setupLightsView:l,pushLight:s,pushShadow:a}}function Qh(n){let e=new WeakMap;function t(r,o=0){let s=e.get(r),a;return s===void 0?(a=new $h(n),e.set(r,[a])):o>=s.length?(a=new $h(n),s.push(a)):a=s[o],a}function i(){e=new WeakMap}return{get:t,dispose:i}}var jh=`
void main(){
gl_Position=vec4( position,1. );
}
`,ed=`
uniform sampler2D shadow_pass;
uniform vec2 resolution;
uniform float radius;
void main(){
const float samples=float( VSM_SAMPLES );
float mean=.0;
float squared_mean=.0;
float uvStride=samples<=1.?.0:2./( samples - 1. );
float uvStart=samples<=1.?.0:- 1.;
for ( float i=.0;i<samples;i++){
float uvOffset=uvStart+i*uvStride;
#ifdef HORIZONTAL_PASS
vec2 distribution=texture2D( shadow_pass,( gl_FragCoord.xy+vec2( uvOffset,.0 )*radius )/resolution ).rg;
mean+=distribution.x;
squared_mean+=distribution.y*distribution.y+distribution.x*distribution.x;
#else
float depth=texture2D( shadow_pass,( gl_FragCoord.xy+vec2( .0,uvOffset )*radius )/resolution ).r;
mean+=depth;
squared_mean+=depth*depth;
#endif
}
mean=mean/samples;
squared_mean=squared_mean/samples;
float std_dev=sqrt( max( .0,squared_mean - mean*mean ) );
gl_FragColor=vec4( mean,std_dev,.0,1. );
}
`;var $m=[new I(1,0,0),new I(-1,0,0),new I(0,1,0),new I(0,-1,0),new I(0,0,1),new I(0,0,-1)],Qm=[new I(0,-1,0),new I(0,-1,0),new I(0,0,1),new I(0,0,-1),new I(0,-1,0),new I(0,-1,0)],td=new we,mo=new I,Wa=new I;function id(n,e,t){let i=new ii,r=new ye,o=new ye,s=new We,a=new ir,c=new nr,l={},f=t.maxTextureSize,d={[li]:at,[at]:li,[Wt]:Wt},h=new ni({defines:{VSM_SAMPLES:8},uniforms:{shadow_pass:{value:null},resolution:{value:new ye},radius:{value:4}},vertexShader:jh,fragmentShader:ed}),m=h.clone();m.defines.HORIZONTAL_PASS=1;let x=new nt;x.setAttribute("position",new $t(new Float32Array([-1,-1,.5,3,-1,.5,-1,3,.5]),3));let v=new Ot(x,h),p=this;this.enabled=!1,this.autoUpdate=!0,this.needsUpdate=!1,this.type=nn;let u=this.type;this.render=function(b,g,T){if(p.enabled===!1||p.autoUpdate===!1&&p.needsUpdate===!1||b.length===0)return;this.type===rl&&(pe("WebGLShadowMap: PCFSoftShadowMap has been removed. Using PCFShadowMap instead."),this.type=nn);let B=n.getRenderTarget(),D=n.getActiveCubeFace(),U=n.getActiveMipmapLevel(),z=n.state;z.setBlending(Gi),z.buffers.depth.getReversed()===!0?z.buffers.color.setClear(0,0,0,0):z.buffers.color.setClear(1,1,1,1),z.buffers.depth.setTest(!0),z.setScissorTest(!1);let $=u!==this.type;$&&g.traverse(function(P){P.material&&(Array.isArray(P.material)?P.material.forEach(W=>W.needsUpdate=!0):P.material.needsUpdate=!0)});for(let P=0,W=b.length;P<W;P++){let K=b[P],H=K.shadow;if(H===void 0){pe("WebGLShadowMap:",K,"has no shadow.");continue}if(H.autoUpdate===!1&&H.needsUpdate===!1)continue;r.copy(H.mapSize);let te=H.getFrameExtents();r.multiply(te),o.copy(H.mapSize),(r.x>f||r.y>f)&&(r.x>f&&(o.x=Math.floor(f/te.x),r.x=o.x*te.x,H.mapSize.x=o.x),r.y>f&&(o.y=Math.floor(f/te.y),r.y=o.y*te.y,H.mapSize.y=o.y));let k=n.state.buffers.depth.getReversed();if(H.camera._reversedDepth=k,H.map===null||$===!0){if(H.map!==null&&(H.map.depthTexture!==null&&(H.map.depthTexture.dispose(),H.map.depthTexture=null),H.map.dispose()),this.type===rn){if(K.isPointLight){pe("WebGLShadowMap: VSM shadow maps are not supported for PointLights. Use PCF or BasicShadowMap instead.");continue}H.map=new Nt(r.x,r.y,{format:jt,type:It,minFilter:ft,magFilter:ft,generateMipmaps:!1}),H.map.texture.name=K.name+".shadowMap",H.map.depthTexture=new vi(r.x,r.y,ut),H.map.depthTexture.name=K.name+".shadowMapDepth",H.map.depthTexture.format=ci,H.map.depthTexture.compareFunction=null,H.map.depthTexture.minFilter=et,H.map.depthTexture.magFilter=et}else K.isPointLight?(H.map=new lr(r.x),H.map.depthTexture=new jn(r.x,Dt)):(H.map=new Nt(r.x,r.y),H.map.depthTexture=new vi(r.x,r.y,Dt)),H.map.depthTexture.name=K.name+".shadowMap",H.map.depthTexture.format=ci,this.type===nn?(H.map.depthTexture.compareFunction=k?Oo:Fo,H.map.depthTexture.minFilter=ft,H.map.depthTexture.magFilter=ft):(H.map.depthTexture.compareFunction=null,H.map.depthTexture.minFilter=et,H.map.depthTexture.magFilter=et);H.camera.updateProjectionMatrix()}H.map.isWebGLCubeRenderTarget!==!0&&(H.map.width!==r.x||H.map.height!==r.y)&&H.map.setSize(r.x,r.y);let J=H.map.isWebGLCubeRenderTarget?6:H.getViewportCount();K.isPointLight!==!0&&H.updateMatrices(K,T);let Q=(H.camera.layers.mask&4294967294)!==0?H.camera.layers:T.layers;for(let Se=0;Se<J;Se++){let Ne=H.getCamera(Se);if(K.isPointLight){let Fe=H.camera,Qe=H.matrix,Ye=K.distance||Fe.far;Ye!==Fe.far&&(Fe.far=Ye,Fe.updateProjectionMatrix()),mo.setFromMatrixPosition(K.matrixWorld),Fe.position.copy(mo),Wa.copy(Fe.position),Wa.add($m[Se]),Fe.up.copy(Qm[Se]),Fe.lookAt(Wa),Fe.updateMatrixWorld(),Qe.makeTranslation(-mo.x,-mo.y,-mo.z),td.multiplyMatrices(Fe.projectionMatrix,Fe.matrixWorldInverse),H._frustum.setFromProjectionMatrix(td,Fe.coordinateSystem,Fe.reversedDepth)}if(H.map.isWebGLCubeRenderTarget)n.setRenderTarget(H.map,Se),n.clear();else{Se===0&&(n.setRenderTarget(H.map),n.clear());let Fe=H.getViewport(Se);s.set(o.x*Fe.x,o.y*Fe.y,o.x*Fe.z,o.y*Fe.w),z.viewport(s)}i=H.getFrustum(Se),M(g,T,Ne,K,Q,this.type)}H.isPointLightShadow!==!0&&this.type===rn&&y(H,T),H.needsUpdate=!1}u=this.type,p.needsUpdate=!1,n.setRenderTarget(B,D,U)};function y(b,g){let T=e.update(v);h.defines.VSM_SAMPLES!==b.blurSamples&&(h.defines.VSM_SAMPLES=b.blurSamples,m.defines.VSM_SAMPLES=b.blurSamples,h.needsUpdate=!0,m.needsUpdate=!0),b.mapPass===null?b.mapPass=new Nt(r.x,r.y,{format:jt,type:It}):(b.mapPass.width!==b.map.width||b.mapPass.height!==b.map.height)&&b.mapPass.setSize(b.map.width,b.map.height),h.uniforms.shadow_pass.value=b.map.depthTexture,h.uniforms.resolution.value.set(b.map.width,b.map.height),h.uniforms.radius.value=b.radius,n.setRenderTarget(b.mapPass),n.clear(),n.renderBufferDirect(g,null,T,h,v,null),m.uniforms.shadow_pass.value=b.mapPass.texture,m.uniforms.resolution.value.set(b.map.width,b.map.height),m.uniforms.radius.value=b.radius,n.setRenderTarget(b.map),n.clear(),n.renderBufferDirect(g,null,T,m,v,null)}function A(b,g,T,B){let D=null,U=T.isPointLight===!0?b.customDistanceMaterial:b.customDepthMaterial;if(U!==void 0)D=U;else if(D=T.isPointLight===!0?c:a,n.localClippingEnabled&&g.clipShadows===!0&&Array.isArray(g.clippingPlanes)&&g.clippingPlanes.length!==0||g.displacementMap&&g.displacementScale!==0||g.alphaMap&&g.alphaTest>0||g.map&&g.alphaTest>0||g.alphaToCoverage===!0){let z=D.uuid,$=g.uuid,P=l[z];P===void 0&&(P={},l[z]=P);let W=P[$];W===void 0&&(W=D.clone(),P[$]=W,g.addEventListener("dispose",C)),D=W}if(D.visible=g.visible,D.wireframe=g.wireframe,B===rn?D.side=g.shadowSide!==null?g.shadowSide:g.side:D.side=g.shadowSide!==null?g.shadowSide:d[g.side],D.alphaMap=g.alphaMap,D.alphaTest=g.alphaToCoverage===!0?.5:g.alphaTest,D.map=g.map,D.clipShadows=g.clipShadows,D.clippingPlanes=g.clippingPlanes,D.clipIntersection=g.clipIntersection,D.displacementMap=g.displacementMap,D.displacementScale=g.displacementScale,D.displacementBias=g.displacementBias,D.wireframeLinewidth=g.wireframeLinewidth,D.linewidth=g.linewidth,T.isPointLight===!0&&D.isMeshDistanceMaterial===!0){let z=n.properties.get(D);z.light=T}return D}function M(b,g,T,B,D,U){if(b.visible===!1)return;if(b.layers.test(D)&&(b.isMesh||b.isLine||b.isPoints)&&(b.castShadow||b.receiveShadow&&U===rn)&&(!b.frustumCulled||b.intersectsFrustum(i))){b.modelViewMatrix.multiplyMatrices(T.matrixWorldInverse,b.matrixWorld);let P=e.update(b),W=b.material;if(Array.isArray(W)){let K=P.groups;for(let H=0,te=K.length;H<te;H++){let k=K[H],J=W[k.materialIndex];if(J&&J.visible){let Q=A(b,J,B,U);b.onBeforeShadow(n,b,g,T,P,Q,k),n.renderBufferDirect(T,null,P,Q,b,k),b.onAfterShadow(n,b,g,T,P,Q,k)}}}else if(W.visible){let K=A(b,W,B,U);b.onBeforeShadow(n,b,g,T,P,K,null),n.renderBufferDirect(T,null,P,K,b,null),b.onAfterShadow(n,b,g,T,P,K,null)}}let $=b.children;for(let P=0,W=$.length;P<W;P++)M($[P],g,T,B,D,U)}function C(b){b.target.removeEventListener("dispose",C);for(let T in l){let B=l[T],D=b.target.uuid;D in B&&(B[D].dispose(),delete B[D])}}}function nd(n,e){function t(){let R=!1,Y=new We,V=null,se=new We(0,0,0,0);return{setMask:function(ie){V!==ie&&!R&&(n.colorMask(ie,ie,ie,ie),V=ie)},setLocked:function(ie){R=ie},setClear:function(ie,re,ve,Ue,ee){ee===!0&&(ie*=Ue,re*=Ue,ve*=Ue),Y.set(ie,re,ve,Ue),se.equals(Y)===!1&&(n.clearColor(ie,re,ve,Ue),se.copy(Y))},reset:function(){R=!1,V=null,se.set(-1,0,0,0)}}}function i(){let R=!1,Y=!1,V=null,se=null,ie=null;return{setReversed:function(re){if(Y!==re){let ve=e.get("EXT_clip_control");re?ve.clipControlEXT(ve.LOWER_LEFT_EXT,ve.ZERO_TO_ONE_EXT):ve.clipControlEXT(ve.LOWER_LEFT_EXT,ve.NEGATIVE_ONE_TO_ONE_EXT),Y=re;let Ue=ie;ie=null,this.setClear(Ue)}},getReversed:function(){return Y},setTest:function(re){re?Te(n.DEPTH_TEST):Ke(n.DEPTH_TEST)},setMask:function(re){V!==re&&!R&&(n.depthMask(re),V=re)},setFunc:function(re){if(Y&&(re=zl[re]),se!==re){switch(re){case ur:n.depthFunc(n.NEVER);break;case hr:n.depthFunc(n.ALWAYS);break;case dr:n.depthFunc(n.LESS);break;case Vi:n.depthFunc(n.LEQUAL);break;case pr:n.depthFunc(n.EQUAL);break;case mr:n.depthFunc(n.GEQUAL);break;case gr:n.depthFunc(n.GREATER);break;case _r:n.depthFunc(n.NOTEQUAL);break;default:n.depthFunc(n.LEQUAL)}se=re}},setLocked:function(re){R=re},setClear:function(re){ie!==re&&(ie=re,Y&&(re=1-re),n.clearDepth(re))},reset:function(){R=!1,V=null,se=null,ie=null,Y=!1}}}function r(){let R=!1,Y=null,V=null,se=null,ie=null,re=null,ve=null,Ue=null,ee=null;return{setTest:function(Ae){R||(Ae?Te(n.STENCIL_TEST):Ke(n.STENCIL_TEST))},setMask:function(Ae){Y!==Ae&&!R&&(n.stencilMask(Ae),Y=Ae)},setFunc:function(Ae,De,he){(V!==Ae||se!==De||ie!==he)&&(n.stencilFunc(Ae,De,he),V=Ae,se=De,ie=he)},setOp:function(Ae,De,he){(re!==Ae||ve!==De||Ue!==he)&&(n.stencilOp(Ae,De,he),re=Ae,ve=De,Ue=he)},setLocked:function(Ae){R=Ae},setClear:function(Ae){ee!==Ae&&(n.clearStencil(Ae),ee=Ae)},reset:function(){R=!1,Y=null,V=null,se=null,ie=null,re=null,ve=null,Ue=null,ee=null}}}let o=new t,s=new i,a=new r,c={},l=new WeakMap,f={},d={},h={},m=new WeakMap,x=[],v=null,p=!1,u=null,y=null,A=null,M=null,C=null,b=null,g=null,T=new Me(0,0,0),B=0,D=!1,U=null,z=null,$=null,P=null,W=null,K=n.getParameter(n.MAX_COMBINED_TEXTURE_IMAGE_UNITS),H=!1,te=0,k=n.getParameter(n.VERSION);k.indexOf("WebGL")!==-1?(te=parseFloat(/^WebGL (\d)/.exec(k)[1]),H=te>=1):k.indexOf("OpenGL ES")!==-1&&(te=parseFloat(/^OpenGL ES (\d)/.exec(k)[1]),H=te>=2);let J=null,Q={},Se=n.getParameter(n.SCISSOR_BOX),Ne=n.getParameter(n.VIEWPORT),Fe=new We().fromArray(Se),Qe=new We().fromArray(Ne);function Ye(R,Y,V,se){let ie=new Uint8Array(4),re=n.createTexture();n.bindTexture(R,re),n.texParameteri(R,n.TEXTURE_MIN_FILTER,n.NEAREST),n.texParameteri(R,n.TEXTURE_MAG_FILTER,n.NEAREST);for(let ve=0;ve<V;ve++)R===n.TEXTURE_3D||R===n.TEXTURE_2D_ARRAY?n.texImage3D(Y,0,n.RGBA,1,1,se,0,n.RGBA,n.UNSIGNED_BYTE,ie):n.texImage2D(Y+ve,0,n.RGBA,1,1,0,n.RGBA,n.UNSIGNED_BYTE,ie);return re}let Ze={};Ze[n.TEXTURE_2D]=Ye(n.TEXTURE_2D,n.TEXTURE_2D,1),Ze[n.TEXTURE_CUBE_MAP]=Ye(n.TEXTURE_CUBE_MAP,n.TEXTURE_CUBE_MAP_POSITIVE_X,6),Ze[n.TEXTURE_2D_ARRAY]=Ye(n.TEXTURE_2D_ARRAY,n.TEXTURE_2D_ARRAY,1,1),Ze[n.TEXTURE_3D]=Ye(n.TEXTURE_3D,n.TEXTURE_3D,1,1),o.setClear(0,0,0,1),s.setClear(1),a.setClear(0),Te(n.DEPTH_TEST),s.setFunc(Vi),kt(!1),rt(Qs),Te(n.CULL_FACE),Qt(Gi);function Te(R){f[R]!==!0&&(n.enable(R),f[R]=!0)}function Ke(R){f[R]!==!1&&(n.disable(R),f[R]=!1)}function pt(R,Y){return h[R]!==Y?(n.bindFramebuffer(R,Y),h[R]=Y,R===n.DRAW_FRAMEBUFFER&&(h[n.FRAMEBUFFER]=Y),R===n.FRAMEBUFFER&&(h[n.DRAW_FRAMEBUFFER]=Y),!0):!1}function Ve(R,Y){let V=x,se=!1;if(R){V=m.get(Y),V===void 0&&(V=[],m.set(Y,V));let ie=R.textures;if(V.length!==ie.length||V[0]!==n.COLOR_ATTACHMENT0){for(let re=0,ve=ie.length;re<ve;re++)V[re]=n.COLOR_ATTACHMENT0+re;V.length=ie.length,se=!0}}else V[0]!==n.BACK&&(V[0]=n.BACK,se=!0);se&&n.drawBuffers(V)}function mt(R){return v!==R?(n.useProgram(R),v=R,!0):!1}let Gt={[Hi]:n.FUNC_ADD,[sl]:n.FUNC_SUBTRACT,[al]:n.FUNC_REVERSE_SUBTRACT};Gt[ll]=n.MIN,Gt[cl]=n.MAX;let bt={[fl]:n.ZERO,[ul]:n.ONE,[hl]:n.SRC_COLOR,[xo]:n.SRC_ALPHA,[xl]:n.SRC_ALPHA_SATURATE,[gl]:n.DST_COLOR,[pl]:n.DST_ALPHA,[dl]:n.ONE_MINUS_SRC_COLOR,[So]:n.ONE_MINUS_SRC_ALPHA,[_l]:n.ONE_MINUS_DST_COLOR,[ml]:n.ONE_MINUS_DST_ALPHA,[Sl]:n.CONSTANT_COLOR,[Ml]:n.ONE_MINUS_CONSTANT_COLOR,[vl]:n.CONSTANT_ALPHA,[El]:n.ONE_MINUS_CONSTANT_ALPHA};function Qt(R,Y,V,se,ie,re,ve,Ue,ee,Ae){if(R===Gi){p===!0&&(Ke(n.BLEND),p=!1);return}if(p===!1&&(Te(n.BLEND),p=!0),R!==ol){if(R!==u||Ae!==D){if((y!==Hi||C!==Hi)&&(n.blendEquation(n.FUNC_ADD),y=Hi,C=Hi),Ae)switch(R){case zi:n.blendFuncSeparate(n.ONE,n.ONE_MINUS_SRC_ALPHA,n.ONE,n.ONE_MINUS_SRC_ALPHA);break;case js:n.blendFunc(n.ONE,n.ONE);break;case ea:n.blendFuncSeparate(n.ZERO,n.ONE_MINUS_SRC_COLOR,n.ZERO,n.ONE);break;case ta:n.blendFuncSeparate(n.DST_COLOR,n.ONE_MINUS_SRC_ALPHA,n.ZERO,n.ONE);break;default:Oe("WebGLState: Invalid blending: ",R);break}else switch(R){case zi:n.blendFuncSeparate(n.SRC_ALPHA,n.ONE_MINUS_SRC_ALPHA,n.ONE,n.ONE_MINUS_SRC_ALPHA);break;case js:n.blendFuncSeparate(n.SRC_ALPHA,n.ONE,n.ONE,n.ONE);break;case ea:Oe("WebGLState: SubtractiveBlending requires material.premultipliedAlpha = true");break;case ta:Oe("WebGLState: MultiplyBlending requires material.premultipliedAlpha = true");break;default:Oe("WebGLState: Invalid blending: ",R);break}A=null,M=null,b=null,g=null,T.set(0,0,0),B=0,u=R,D=Ae}return}ie=ie||Y,re=re||V,ve=ve||se,(Y!==y||ie!==C)&&(n.blendEquationSeparate(Gt[Y],Gt[ie]),y=Y,C=ie),(V!==A||se!==M||re!==b||ve!==g)&&(n.blendFuncSeparate(bt[V],bt[se],bt[re],bt[ve]),A=V,M=se,b=re,g=ve),(Ue.equals(T)===!1||ee!==B)&&(n.blendColor(Ue.r,Ue.g,Ue.b,ee),T.copy(Ue),B=ee),u=R,D=!1}function gt(R,Y){R.side===Wt?Ke(n.CULL_FACE):Te(n.CULL_FACE);let V=R.side===at;Y&&(V=!V),kt(V),R.blending===zi&&R.transparent===!1?Qt(Gi):Qt(R.blending,R.blendEquation,R.blendSrc,R.blendDst,R.blendEquationAlpha,R.blendSrcAlpha,R.blendDstAlpha,R.blendColor,R.blendAlpha,R.premultipliedAlpha),s.setFunc(R.depthFunc),s.setTest(R.depthTest),s.setMask(R.depthWrite),o.setMask(R.colorWrite);let se=R.stencilWrite;a.setTest(se),se&&(a.setMask(R.stencilWriteMask),a.setFunc(R.stencilFunc,R.stencilRef,R.stencilFuncMask),a.setOp(R.stencilFail,R.stencilZFail,R.stencilZPass)),Mt(R.polygonOffset,R.polygonOffsetFactor,R.polygonOffsetUnits),R.alphaToCoverage===!0?Te(n.SAMPLE_ALPHA_TO_COVERAGE):Ke(n.SAMPLE_ALPHA_TO_COVERAGE)}function kt(R){U!==R&&(R?n.frontFace(n.CW):n.frontFace(n.CCW),U=R)}function rt(R){R!==il?(Te(n.CULL_FACE),R!==z&&(R===Qs?n.cullFace(n.BACK):R===nl?n.cullFace(n.FRONT):n.cullFace(n.FRONT_AND_BACK))):Ke(n.CULL_FACE),z=R}function Ti(R){R!==$&&(H&&n.lineWidth(R),$=R)}function Mt(R,Y,V){R?(Te(n.POLYGON_OFFSET_FILL),(P!==Y||W!==V)&&(P=Y,W=V,s.getReversed()&&(Y=-Y,V=-V),n.polygonOffset(Y,V))):Ke(n.POLYGON_OFFSET_FILL)}function ri(R){R?Te(n.SCISSOR_TEST):Ke(n.SCISSOR_TEST)}function oi(R){R===void 0&&(R=n.TEXTURE0+K-1),J!==R&&(n.activeTexture(R),J=R)}function si(R,Y,V){V===void 0&&(J===null?V=n.TEXTURE0+K-1:V=J);let se=Q[V];se===void 0&&(se={type:void 0,texture:void 0},Q[V]=se),(se.type!==R||se.texture!==Y)&&(J!==V&&(n.activeTexture(V),J=V),n.bindTexture(R,Y||Ze[R]),se.type=R,se.texture=Y)}function L(){let R=Q[J];R!==void 0&&R.type!==void 0&&(n.bindTexture(R.type,null),R.type=void 0,R.texture=void 0)}function ai(){try{n.compressedTexImage2D(...arguments)}catch(R){Oe("WebGLState:",R)}}function tt(){try{n.compressedTexImage3D(...arguments)}catch(R){Oe("WebGLState:",R)}}function it(){try{n.texSubImage2D(...arguments)}catch(R){Oe("WebGLState:",R)}}function fe(){try{n.texSubImage3D(...arguments)}catch(R){Oe("WebGLState:",R)}}function _t(){try{n.compressedTexSubImage2D(...arguments)}catch(R){Oe("WebGLState:",R)}}function be(){try{n.compressedTexSubImage3D(...arguments)}catch(R){Oe("WebGLState:",R)}}function Ce(){try{n.texStorage2D(...arguments)}catch(R){Oe("WebGLState:",R)}}function E(){try{n.texStorage3D(...arguments)}catch(R){Oe("WebGLState:",R)}}function _(){try{n.texImage2D(...arguments)}catch(R){Oe("WebGLState:",R)}}function F(){try{n.texImage3D(...arguments)}catch(R){Oe("WebGLState:",R)}}function j(R){return d[R]!==void 0?d[R]:n.getParameter(R)}function Z(R,Y){d[R]!==Y&&(n.pixelStorei(R,Y),d[R]=Y)}function ne(R){Fe.equals(R)===!1&&(n.scissor(R.x,R.y,R.z,R.w),Fe.copy(R))}function le(R){Qe.equals(R)===!1&&(n.viewport(R.x,R.y,R.z,R.w),Qe.copy(R))}function X(R,Y){let V=l.get(Y);V===void 0&&(V=new WeakMap,l.set(Y,V));let se=V.get(R);se===void 0&&(se=n.getUniformBlockIndex(Y,R.name),n.uniformBlockBinding(Y,se,se),V.set(R,se))}function q(R,Y,V){let ie=l.get(Y).get(R);c[ie]!==V&&(n.bindBufferBase(n.UNIFORM_BUFFER,ie,V),c[ie]=V)}function oe(){n.disable(n.BLEND),n.disable(n.CULL_FACE),n.disable(n.DEPTH_TEST),n.disable(n.POLYGON_OFFSET_FILL),n.disable(n.SCISSOR_TEST),n.disable(n.STENCIL_TEST),n.disable(n.SAMPLE_ALPHA_TO_COVERAGE),n.blendEquation(n.FUNC_ADD),n.blendFunc(n.ONE,n.ZERO),n.blendFuncSeparate(n.ONE,n.ZERO,n.ONE,n.ZERO),n.blendColor(0,0,0,0),n.colorMask(!0,!0,!0,!0),n.clearColor(0,0,0,0),n.depthMask(!0),n.depthFunc(n.LESS),s.setReversed(!1),n.clearDepth(1),n.stencilMask(4294967295),n.stencilFunc(n.ALWAYS,0,4294967295),n.stencilOp(n.KEEP,n.KEEP,n.KEEP),n.clearStencil(0),n.cullFace(n.BACK),n.frontFace(n.CCW),n.polygonOffset(0,0),n.activeTexture(n.TEXTURE0),n.bindFramebuffer(n.FRAMEBUFFER,null),n.bindFramebuffer(n.DRAW_FRAMEBUFFER,null),n.bindFramebuffer(n.READ_FRAMEBUFFER,null),n.useProgram(null),n.lineWidth(1),n.scissor(0,0,n.canvas.width,n.canvas.height),n.viewport(0,0,n.canvas.width,n.canvas.height),n.pixelStorei(n.PACK_ALIGNMENT,4),n.pixelStorei(n.UNPACK_ALIGNMENT,4),n.pixelStorei(n.UNPACK_FLIP_Y_WEBGL,!1),n.pixelStorei(n.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),n.pixelStorei(n.UNPACK_COLORSPACE_CONVERSION_WEBGL,n.BROWSER_DEFAULT_WEBGL),n.pixelStorei(n.PACK_ROW_LENGTH,0),n.pixelStorei(n.PACK_SKIP_PIXELS,0),n.pixelStorei(n.PACK_SKIP_ROWS,0),n.pixelStorei(n.UNPACK_ROW_LENGTH,0),n.pixelStorei(n.UNPACK_IMAGE_HEIGHT,0),n.pixelStorei(n.UNPACK_SKIP_PIXELS,0),n.pixelStorei(n.UNPACK_SKIP_ROWS,0),n.pixelStorei(n.UNPACK_SKIP_IMAGES,0),f={},d={},J=null,Q={},h={},c={},m=new WeakMap,x=[],v=null,p=!1,u=null,y=null,A=null,M=null,C=null,b=null,g=null,T=new Me(0,0,0),B=0,D=!1,U=null,z=null,$=null,P=null,W=null,Fe.set(0,0,n.canvas.width,n.canvas.height),Qe.set(0,0,n.canvas.width,n.canvas.height),o.reset(),s.reset(),a.reset()}return{buffers:{color:o,depth:s,stencil:a},enable:Te,disable:Ke,bindFramebuffer:pt,drawBuffers:Ve,useProgram:mt,setBlending:Qt,setMaterial:gt,setFlipSided:kt,setCullFace:rt,setLineWidth:Ti,setPolygonOffset:Mt,setScissorTest:ri,activeTexture:oi,bindTexture:si,unbindTexture:L,compressedTexImage2D:ai,compressedTexImage3D:tt,texImage2D:_,texImage3D:F,pixelStorei:Z,getParameter:j,updateUBOMapping:X,uniformBlockBinding:q,texStorage2D:Ce,texStorage3D:E,texSubImage2D:it,texSubImage3D:fe,compressedTexSubImage2D:_t,compressedTexSubImage3D:be,scissor:ne,viewport:le,reset:oe}}function rd(n,e,t,i,r,o,s){let a=e.has("WEBGL_multisampled_render_to_texture")?e.get("WEBGL_multisampled_render_to_texture"):null,c=typeof navigator>"u"?!1:/OculusBrowser/g.test(navigator.userAgent),l=new ye,f=new WeakMap,d=new Set,h,m=new WeakMap,x=new Set,v=new FinalizationRegistry(E=>x.delete(E)),p=!1;try{p=typeof OffscreenCanvas<"u"&&new OffscreenCanvas(1,1).getContext("2d")!==null}catch{}function u(E,_){return p?new OffscreenCanvas(E,_):Ln("canvas")}function y(E,_,F){let j=1,Z=Ce(E);if((Z.width>F||Z.height>F)&&(j=F/Math.max(Z.width,Z.height)),j<1)if(typeof HTMLImageElement<"u"&&E instanceof HTMLImageElement||typeof HTMLCanvasElement<"u"&&E instanceof HTMLCanvasElement||typeof ImageBitmap<"u"&&E instanceof ImageBitmap||typeof VideoFrame<"u"&&E instanceof VideoFrame){let ne=Math.floor(j*Z.width),le=Math.floor(j*Z.height);h===void 0&&(h=u(ne,le));let X=_?u(ne,le):h;return X.width=ne,X.height=le,X.getContext("2d").drawImage(E,0,0,ne,le),pe("WebGLRenderer: Texture has been resized from ("+Z.width+"x"+Z.height+") to ("+ne+"x"+le+")."),X}else return"data"in E&&pe("WebGLRenderer: Image in DataTexture is too big ("+Z.width+"x"+Z.height+")."),E;return E}function A(E){return E.generateMipmaps}function M(E){n.generateMipmap(E)}function C(E){return E.isWebGLCubeRenderTarget?n.TEXTURE_CUBE_MAP:E.isWebGL3DRenderTarget?n.TEXTURE_3D:E.isWebGLArrayRenderTarget||E.isCompressedArrayTexture?n.TEXTURE_2D_ARRAY:n.TEXTURE_2D}function b(E,_,F,j,Z,ne=!1){if(E!==null){if(n[E]!==void 0)return n[E];pe("WebGLRenderer: Attempt to use non-existing WebGL internal format '"+E+"'")}let le;j&&(le=e.get("EXT_texture_norm16"),le||pe("WebGLRenderer: Unable to use normalized textures without EXT_texture_norm16 extension"));let X=_;if(_===n.RED&&(F===n.FLOAT&&(X=n.R32F),F===n.HALF_FLOAT&&(X=n.R16F),F===n.UNSIGNED_BYTE&&(X=n.R8),F===n.UNSIGNED_SHORT&&le&&(X=le.R16_EXT),F===n.SHORT&&le&&(X=le.R16_SNORM_EXT)),_===n.RED_INTEGER&&(F===n.UNSIGNED_BYTE&&(X=n.R8UI),F===n.UNSIGNED_SHORT&&(X=n.R16UI),F===n.UNSIGNED_INT&&(X=n.R32UI),F===n.BYTE&&(X=n.R8I),F===n.SHORT&&(X=n.R16I),F===n.INT&&(X=n.R32I)),_===n.RG&&(F===n.FLOAT&&(X=n.RG32F),F===n.HALF_FLOAT&&(X=n.RG16F),F===n.UNSIGNED_BYTE&&(X=n.RG8),F===n.UNSIGNED_SHORT&&le&&(X=le.RG16_EXT),F===n.SHORT&&le&&(X=le.RG16_SNORM_EXT)),_===n.RG_INTEGER&&(F===n.UNSIGNED_BYTE&&(X=n.RG8UI),F===n.UNSIGNED_SHORT&&(X=n.RG16UI),F===n.UNSIGNED_INT&&(X=n.RG32UI),F===n.BYTE&&(X=n.RG8I),F===n.SHORT&&(X=n.RG16I),F===n.INT&&(X=n.RG32I)),_===n.RGB_INTEGER&&(F===n.UNSIGNED_BYTE&&(X=n.RGB8UI),F===n.UNSIGNED_SHORT&&(X=n.RGB16UI),F===n.UNSIGNED_INT&&(X=n.RGB32UI),F===n.BYTE&&(X=n.RGB8I),F===n.SHORT&&(X=n.RGB16I),F===n.INT&&(X=n.RGB32I)),_===n.RGBA_INTEGER&&(F===n.UNSIGNED_BYTE&&(X=n.RGBA8UI),F===n.UNSIGNED_SHORT&&(X=n.RGBA16UI),F===n.UNSIGNED_INT&&(X=n.RGBA32UI),F===n.BYTE&&(X=n.RGBA8I),F===n.SHORT&&(X=n.RGBA16I),F===n.INT&&(X=n.RGBA32I)),_===n.RGB&&(F===n.UNSIGNED_SHORT&&le&&(X=le.RGB16_EXT),F===n.SHORT&&le&&(X=le.RGB16_SNORM_EXT),F===n.UNSIGNED_INT_5_9_9_9_REV&&(X=n.RGB9_E5),F===n.UNSIGNED_INT_10F_11F_11F_REV&&(X=n.R11F_G11F_B10F)),_===n.RGBA){let q=ne?cn:Re.getTransfer(Z);F===n.FLOAT&&(X=n.RGBA32F),F===n.HALF_FLOAT&&(X=n.RGBA16F),F===n.UNSIGNED_BYTE&&(X=q===ze?n.SRGB8_ALPHA8:n.RGBA8),F===n.UNSIGNED_SHORT&&le&&(X=le.RGBA16_EXT),F===n.SHORT&&le&&(X=le.RGBA16_SNORM_EXT),F===n.UNSIGNED_SHORT_4_4_4_4&&(X=n.RGBA4),F===n.UNSIGNED_SHORT_5_5_5_1&&(X=n.RGB5_A1)}return(X===n.R16F||X===n.R32F||X===n.RG16F||X===n.RG32F||X===n.RGBA16F||X===n.RGBA32F)&&e.get("EXT_color_buffer_float"),X}function g(E,_){let F;return E?_===null||_===Dt||_===Ci?F=n.DEPTH24_STENCIL8:_===ut?F=n.DEPTH32F_STENCIL8:_===wi&&(F=n.DEPTH24_STENCIL8,pe("DepthTexture: 16 bit depth attachment is not supported with stencil. Using 24-bit attachment.")):_===null||_===Dt||_===Ci?F=n.DEPTH_COMPONENT24:_===ut?F=n.DEPTH_COMPONENT32F:_===wi&&(F=n.DEPTH_COMPONENT16),F}function T(E,_){return A(E)===!0||E.isFramebufferTexture&&E.minFilter!==et&&E.minFilter!==ft?Math.log2(Math.max(_.width,_.height))+1:E.mipmaps.length>0?E.mipmaps.length:E.isCompressedTexture&&Array.isArray(E.image)?_.mipmaps.length:1}function B(E){let _=new WeakRef(E);i.get(E).__ref=_,x.add(_),v.register(E,_,_)}function D(E){let _=i.get(E).__ref;_!==void 0&&(x.delete(_),v.unregister(_))}function U(E){$(E.target)}function z(E){P(E.target)}function $(E){E.removeEventListener("dispose",U),D(E),K(E),E.isVideoTexture&&f.delete(E),E.isHTMLTexture&&d.delete(E)}function P(E){E.removeEventListener("dispose",z),D(E),te(E)}function W(){for(let E of x){let _=E.deref();_!==void 0&&(_.isRenderTarget===!0?P(_):$(_))}x.clear(),d.clear()}function K(E){let _=i.get(E);if(_.__webglInit===void 0)return;let F=E.source,j=m.get(F);if(j){let Z=j[_.__cacheKey];Z.usedTimes--,Z.usedTimes===0&&H(E),Object.keys(j).length===0&&m.delete(F)}i.remove(E)}function H(E){let _=i.get(E);n.deleteTexture(_.__webglTexture);let F=E.source,j=m.get(F);delete j[_.__cacheKey],s.memory.textures--}function te(E){let _=i.get(E);_.__depthDisposeCallback&&_.__depthDisposeCallback();let F=E.depthTexture;if(F&&F.renderTarget===E&&$(F),E.isWebGLCubeRenderTarget)for(let Z=0;Z<6;Z++){if(Array.isArray(_.__webglFramebuffer[Z]))for(let ne=0;ne<_.__webglFramebuffer[Z].length;ne++)n.deleteFramebuffer(_.__webglFramebuffer[Z][ne]);else n.deleteFramebuffer(_.__webglFramebuffer[Z]);_.__webglDepthbuffer&&n.deleteRenderbuffer(_.__webglDepthbuffer[Z])}else{if(Array.isArray(_.__webglFramebuffer))for(let Z=0;Z<_.__webglFramebuffer.length;Z++)n.deleteFramebuffer(_.__webglFramebuffer[Z]);else n.deleteFramebuffer(_.__webglFramebuffer);if(_.__webglDepthbuffer&&n.deleteRenderbuffer(_.__webglDepthbuffer),_.__webglMultisampledFramebuffer&&n.deleteFramebuffer(_.__webglMultisampledFramebuffer),_.__webglColorRenderbuffer)for(let Z=0;Z<_.__webglColorRenderbuffer.length;Z++)_.__webglColorRenderbuffer[Z]&&n.deleteRenderbuffer(_.__webglColorRenderbuffer[Z]);_.__webglDepthRenderbuffer&&n.deleteRenderbuffer(_.__webglDepthRenderbuffer)}let j=E.textures;for(let Z=0,ne=j.length;Z<ne;Z++){let le=i.get(j[Z]);le.__webglTexture&&(n.deleteTexture(le.__webglTexture),s.memory.textures--),i.remove(j[Z])}i.remove(E)}let k=0;function J(){k=0}function Q(){return k}function Se(E){k=E}function Ne(){let E=k;return E>=r.maxTextures&&pe("WebGLTextures: Trying to use "+(E+1)+" texture units while this GPU supports only "+r.maxTextures),k+=1,E}function Fe(E){let _=[];return _.push(E.wrapS),_.push(E.wrapT),_.push(E.wrapR||0),_.push(E.magFilter),_.push(E.minFilter),_.push(E.anisotropy),_.push(E.internalFormat),_.push(E.format),_.push(E.type),_.push(E.generateMipmaps),_.push(E.mipmapsAutoUpdate),_.push(E.premultiplyAlpha),_.push(E.flipY),_.push(E.unpackAlignment),_.push(E.colorSpace),_.join()}function Qe(E,_){let F=i.get(E);if(E.isVideoTexture&&_t(E),E.isRenderTargetTexture===!1&&E.isExternalTexture!==!0&&E.version>0&&F.__version!==E.version){let j=E.image;if(j===null)pe("WebGLRenderer: Texture marked for update but no image data found.");else if(j.complete===!1)pe("WebGLRenderer: Texture marked for update but image is incomplete");else{gt(F,E,_);return}}else E.isExternalTexture&&(F.__webglTexture=E.sourceTexture?E.sourceTexture:null);t.bindTexture(n.TEXTURE_2D,F.__webglTexture,n.TEXTURE0+_)}function Ye(E,_){let F=i.get(E);if(E.isRenderTargetTexture===!1&&E.version>0&&F.__version!==E.version){gt(F,E,_);return}else E.isExternalTexture&&(F.__webglTexture=E.sourceTexture?E.sourceTexture:null);t.bindTexture(n.TEXTURE_2D_ARRAY,F.__webglTexture,n.TEXTURE0+_)}function Ze(E,_){let F=i.get(E);if(E.isRenderTargetTexture===!1&&E.version>0&&F.__version!==E.version){gt(F,E,_);return}t.bindTexture(n.TEXTURE_3D,F.__webglTexture,n.TEXTURE0+_)}function Te(E,_){let F=i.get(E);if(E.version>0&&F.__version!==E.version){kt(F,E,_);return}t.bindTexture(n.TEXTURE_CUBE_MAP,F.__webglTexture,n.TEXTURE0+_)}let Ke={[Mr]:n.REPEAT,[qt]:n.CLAMP_TO_EDGE,[vr]:n.MIRRORED_REPEAT},pt={[et]:n.NEAREST,[Al]:n.NEAREST_MIPMAP_NEAREST,[Er]:n.NEAREST_MIPMAP_LINEAR,[ft]:n.LINEAR,[wo]:n.LINEAR_MIPMAP_NEAREST,[pi]:n.LINEAR_MIPMAP_LINEAR},Ve={[Cl]:n.NEVER,[Bo]:n.ALWAYS,[Pl]:n.LESS,[Fo]:n.LEQUAL,[Ll]:n.EQUAL,[Oo]:n.GEQUAL,[Dl]:n.GREATER,[Il]:n.NOTEQUAL};function mt(E,_){if(_.type===ut&&e.has("OES_texture_float_linear")===!1&&(_.magFilter===ft||_.magFilter===wo||_.magFilter===Er||_.magFilter===pi||_.minFilter===ft||_.minFilter===wo||_.minFilter===Er||_.minFilter===pi)&&pe("WebGLRenderer: Unable to use linear filtering with floating point textures. OES_texture_float_linear not supported on this device."),n.texParameteri(E,n.TEXTURE_WRAP_S,Ke[_.wrapS]),n.texParameteri(E,n.TEXTURE_WRAP_T,Ke[_.wrapT]),(E===n.TEXTURE_3D||E===n.TEXTURE_2D_ARRAY)&&n.texParameteri(E,n.TEXTURE_WRAP_R,Ke[_.wrapR]),n.texParameteri(E,n.TEXTURE_MAG_FILTER,pt[_.magFilter]),n.texParameteri(E,n.TEXTURE_MIN_FILTER,pt[_.minFilter]),_.compareFunction&&(n.texParameteri(E,n.TEXTURE_COMPARE_MODE,n.COMPARE_REF_TO_TEXTURE),n.texParameteri(E,n.TEXTURE_COMPARE_FUNC,Ve[_.compareFunction])),e.has("EXT_texture_filter_anisotropic")===!0){if(_.magFilter===et||_.minFilter!==Er&&_.minFilter!==pi||_.type===ut&&e.has("OES_texture_float_linear")===!1)return;if(_.anisotropy>1||i.get(_).__currentAnisotropy){let F=e.get("EXT_texture_filter_anisotropic");n.texParameterf(E,F.TEXTURE_MAX_ANISOTROPY_EXT,Math.min(_.anisotropy,r.getMaxAnisotropy())),i.get(_).__currentAnisotropy=_.anisotropy}}}function Gt(E,_){let F=!1;E.__webglInit===void 0&&(E.__webglInit=!0,_.addEventListener("dispose",U),B(_));let j=_.source,Z=m.get(j);Z===void 0&&(Z={},m.set(j,Z));let ne=Fe(_);if(ne!==E.__cacheKey){Z[ne]===void 0&&(Z[ne]={texture:n.createTexture(),usedTimes:0},s.memory.textures++,F=!0),Z[ne].usedTimes++;let le=Z[E.__cacheKey];le!==void 0&&(Z[E.__cacheKey].usedTimes--,le.usedTimes===0&&H(_)),E.__cacheKey=ne,E.__webglTexture=Z[ne].texture}return F}function bt(E,_,F){return Math.floor(Math.floor(E/F)/_)}function Qt(E,_,F,j){let ne=E.updateRanges;if(ne.length===0)t.texSubImage2D(n.TEXTURE_2D,0,0,0,_.width,_.height,F,j,_.data);else{ne.sort((R,Y)=>R.start-Y.start);let le=0;for(let R=1;R<ne.length;R++){let Y=ne[le],V=ne[R],se=Y.start+Y.count,ie=bt(V.start,_.width,4),re=bt(Y.start,_.width,4);V.start<=se+1&&ie===re&&bt(V.start+V.count-1,_.width,4)===ie?Y.count=Math.max(Y.count,V.start+V.count-Y.start):(++le,ne[le]=V)}ne.length=le+1;let X=t.getParameter(n.UNPACK_ROW_LENGTH),q=t.getParameter(n.UNPACK_SKIP_PIXELS),oe=t.getParameter(n.UNPACK_SKIP_ROWS);t.pixelStorei(n.UNPACK_ROW_LENGTH,_.width);for(let R=0,Y=ne.length;R<Y;R++){let V=ne[R],se=Math.floor(V.start/4),ie=Math.ceil(V.count/4),re=se%_.width,ve=Math.floor(se/_.width),Ue=ie,ee=1;t.pixelStorei(n.UNPACK_SKIP_PIXELS,re),t.pixelStorei(n.UNPACK_SKIP_ROWS,ve),t.texSubImage2D(n.TEXTURE_2D,0,re,ve,Ue,ee,F,j,_.data)}E.clearUpdateRanges(),t.pixelStorei(n.UNPACK_ROW_LENGTH,X),t.pixelStorei(n.UNPACK_SKIP_PIXELS,q),t.pixelStorei(n.UNPACK_SKIP_ROWS,oe)}}function gt(E,_,F){let j=n.TEXTURE_2D;(_.isDataArrayTexture||_.isCompressedArrayTexture)&&(j=n.TEXTURE_2D_ARRAY),_.isData3DTexture&&(j=n.TEXTURE_3D);let Z=Gt(E,_),ne=_.source;t.bindTexture(j,E.__webglTexture,n.TEXTURE0+F);let le=i.get(ne);if(ne.version!==le.__version||Z===!0){if(t.activeTexture(n.TEXTURE0+F),(typeof ImageBitmap<"u"&&_.image instanceof ImageBitmap)===!1){let ee=Re.getPrimaries(Re.workingColorSpace),Ae=_.colorSpace===fi?null:Re.getPrimaries(_.colorSpace),De=_.colorSpace===fi||ee===Ae?n.NONE:n.BROWSER_DEFAULT_WEBGL;t.pixelStorei(n.UNPACK_FLIP_Y_WEBGL,_.flipY),t.pixelStorei(n.UNPACK_PREMULTIPLY_ALPHA_WEBGL,_.premultiplyAlpha),t.pixelStorei(n.UNPACK_COLORSPACE_CONVERSION_WEBGL,De)}t.pixelStorei(n.UNPACK_ALIGNMENT,_.unpackAlignment);let q=y(_.image,!1,r.maxTextureSize);q=be(_,q);let oe=o.convert(_.format,_.colorSpace),R=o.convert(_.type),Y=b(_.internalFormat,oe,R,_.normalized,_.colorSpace,_.isVideoTexture);mt(j,_);let V,se=_.mipmaps,ie=_.isVideoTexture!==!0,re=le.__version===void 0||Z===!0,ve=ne.dataReady,Ue=T(_,q);if(_.isDepthTexture)Y=g(_.format===mi,_.type),re&&(ie?t.texStorage2D(n.TEXTURE_2D,1,Y,q.width,q.height):t.texImage2D(n.TEXTURE_2D,0,Y,q.width,q.height,0,oe,R,null));else if(_.isDataTexture)if(se.length>0){ie&&re&&t.texStorage2D(n.TEXTURE_2D,Ue,Y,se[0].width,se[0].height);for(let ee=0,Ae=se.length;ee<Ae;ee++)V=se[ee],ie?ve&&t.texSubImage2D(n.TEXTURE_2D,ee,0,0,V.width,V.height,oe,R,V.data):t.texImage2D(n.TEXTURE_2D,ee,Y,V.width,V.height,0,oe,R,V.data);_.generateMipmaps=!1}else ie?(re&&t.texStorage2D(n.TEXTURE_2D,Ue,Y,q.width,q.height),ve&&Qt(_,q,oe,R)):t.texImage2D(n.TEXTURE_2D,0,Y,q.width,q.height,0,oe,R,q.data);else if(_.isCompressedTexture)if(_.isCompressedArrayTexture){ie&&re&&t.texStorage3D(n.TEXTURE_2D_ARRAY,Ue,Y,se[0].width,se[0].height,q.depth);for(let ee=0,Ae=se.length;ee<Ae;ee++)if(V=se[ee],_.format!==Yt)if(oe!==null)if(ie){if(ve)if(_.layerUpdates.size>0){let De=Na(V.width,V.height,_.format,_.type);for(let he of _.layerUpdates){let qe=V.data.subarray(he*De/V.data.BYTES_PER_ELEMENT,(he+1)*De/V.data.BYTES_PER_ELEMENT);t.compressedTexSubImage3D(n.TEXTURE_2D_ARRAY,ee,0,0,he,V.width,V.height,1,oe,qe)}}else t.compressedTexSubImage3D(n.TEXTURE_2D_ARRAY,ee,0,0,0,V.width,V.height,q.depth,oe,V.data)}else t.compressedTexImage3D(n.TEXTURE_2D_ARRAY,ee,Y,V.width,V.height,q.depth,0,V.data,0,0);else pe("WebGLRenderer: Attempt to load unsupported compressed texture format in .uploadTexture()");else ie?ve&&t.texSubImage3D(n.TEXTURE_2D_ARRAY,ee,0,0,0,V.width,V.height,q.depth,oe,R,V.data):t.texImage3D(n.TEXTURE_2D_ARRAY,ee,Y,V.width,V.height,q.depth,0,oe,R,V.data);_.layerUpdates.size>0&&_.clearLayerUpdates()}else{ie&&re&&t.texStorage2D(n.TEXTURE_2D,Ue,Y,se[0].width,se[0].height);for(let ee=0,Ae=se.length;ee<Ae;ee++)V=se[ee],_.format!==Yt?oe!==null?ie?ve&&t.compressedTexSubImage2D(n.TEXTURE_2D,ee,0,0,V.width,V.height,oe,V.data):t.compressedTexImage2D(n.TEXTURE_2D,ee,Y,V.width,V.height,0,V.data):pe("WebGLRenderer: Attempt to load unsupported compressed texture format in .uploadTexture()"):ie?ve&&t.texSubImage2D(n.TEXTURE_2D,ee,0,0,V.width,V.height,oe,R,V.data):t.texImage2D(n.TEXTURE_2D,ee,Y,V.width,V.height,0,oe,R,V.data)}else if(_.isDataArrayTexture)if(ie){if(re&&t.texStorage3D(n.TEXTURE_2D_ARRAY,Ue,Y,q.width,q.height,q.depth),ve)if(_.layerUpdates.size>0){let ee=Na(q.width,q.height,_.format,_.type);for(let Ae of _.layerUpdates){let De=q.data.subarray(Ae*ee/q.data.BYTES_PER_ELEMENT,(Ae+1)*ee/q.data.BYTES_PER_ELEMENT);t.texSubImage3D(n.TEXTURE_2D_ARRAY,0,0,0,Ae,q.width,q.height,1,oe,R,De)}_.clearLayerUpdates()}else t.texSubImage3D(n.TEXTURE_2D_ARRAY,0,0,0,0,q.width,q.height,q.depth,oe,R,q.data)}else t.texImage3D(n.TEXTURE_2D_ARRAY,0,Y,q.width,q.height,q.depth,0,oe,R,q.data);else if(_.isData3DTexture)ie?(re&&t.texStorage3D(n.TEXTURE_3D,Ue,Y,q.width,q.height,q.depth),ve&&t.texSubImage3D(n.TEXTURE_3D,0,0,0,0,q.width,q.height,q.depth,oe,R,q.data)):t.texImage3D(n.TEXTURE_3D,0,Y,q.width,q.height,q.depth,0,oe,R,q.data);else if(_.isFramebufferTexture){if(re)if(ie)t.texStorage2D(n.TEXTURE_2D,Ue,Y,q.width,q.height);else{let ee=q.width,Ae=q.height;for(let De=0;De<Ue;De++)t.texImage2D(n.TEXTURE_2D,De,Y,ee,Ae,0,oe,R,null),ee>>=1,Ae>>=1}}else if(_.isHTMLTexture){if("texElementImage2D"in n){let ee=n.canvas;if(ee.hasAttribute("layoutsubtree")||ee.setAttribute("layoutsubtree","true"),q.parentNode!==ee){ee.appendChild(q),d.add(_),ee.onpaint=Ae=>{let De=Ae.changedElements;for(let he of d)De.includes(he.image)&&(he.needsUpdate=!0)},ee.requestPaint();return}if(n.texElementImage2D.length===3)n.texElementImage2D(n.TEXTURE_2D,n.RGBA8,q);else{let De=n.RGBA,he=n.RGBA,qe=n.UNSIGNED_BYTE;n.texElementImage2D(n.TEXTURE_2D,0,De,he,qe,q)}n.texParameteri(n.TEXTURE_2D,n.TEXTURE_MIN_FILTER,n.LINEAR),n.texParameteri(n.TEXTURE_2D,n.TEXTURE_WRAP_S,n.CLAMP_TO_EDGE),n.texParameteri(n.TEXTURE_2D,n.TEXTURE_WRAP_T,n.CLAMP_TO_EDGE)}}else if(se.length>0){if(ie&&re){let ee=Ce(se[0]);t.texStorage2D(n.TEXTURE_2D,Ue,Y,ee.width,ee.height)}for(let ee=0,Ae=se.length;ee<Ae;ee++)V=se[ee],ie?ve&&t.texSubImage2D(n.TEXTURE_2D,ee,0,0,oe,R,V):t.texImage2D(n.TEXTURE_2D,ee,Y,oe,R,V);_.generateMipmaps=!1}else if(ie){if(re){let ee=Ce(q);t.texStorage2D(n.TEXTURE_2D,Ue,Y,ee.width,ee.height)}ve&&t.texSubImage2D(n.TEXTURE_2D,0,0,0,oe,R,q)}else t.texImage2D(n.TEXTURE_2D,0,Y,oe,R,q);A(_)&&_.mipmapsAutoUpdate===!0&&M(j),le.__version=ne.version,_.onUpdate&&_.onUpdate(_)}E.__version=_.version}function kt(E,_,F){if(_.image.length!==6)return;let j=Gt(E,_),Z=_.source;t.bindTexture(n.TEXTURE_CUBE_MAP,E.__webglTexture,n.TEXTURE0+F);let ne=i.get(Z);if(Z.version!==ne.__version||j===!0){t.activeTexture(n.TEXTURE0+F);let le=Re.getPrimaries(Re.workingColorSpace),X=_.colorSpace===fi?null:Re.getPrimaries(_.colorSpace),q=_.colorSpace===fi||le===X?n.NONE:n.BROWSER_DEFAULT_WEBGL;t.pixelStorei(n.UNPACK_FLIP_Y_WEBGL,_.flipY),t.pixelStorei(n.UNPACK_PREMULTIPLY_ALPHA_WEBGL,_.premultiplyAlpha),t.pixelStorei(n.UNPACK_ALIGNMENT,_.unpackAlignment),t.pixelStorei(n.UNPACK_COLORSPACE_CONVERSION_WEBGL,q);let oe=_.isCompressedTexture||_.image[0].isCompressedTexture,R=_.image[0]&&_.image[0].isDataTexture,Y=[];for(let he=0;he<6;he++)!oe&&!R?Y[he]=y(_.image[he],!0,r.maxCubemapSize):Y[he]=R?_.image[he].image:_.image[he],Y[he]=be(_,Y[he]);let V=Y[0],se=o.convert(_.format,_.colorSpace),ie=o.convert(_.type),re=b(_.internalFormat,se,ie,_.normalized,_.colorSpace),ve=_.isVideoTexture!==!0,Ue=ne.__version===void 0||j===!0,ee=Z.dataReady,Ae=T(_,V);mt(n.TEXTURE_CUBE_MAP,_);let De;if(_.isDepthTexture){if(re=g(_.format===mi,_.type),Ue)if(ve)t.texStorage2D(n.TEXTURE_CUBE_MAP,1,re,V.width,V.height);else for(let he=0;he<6;he++)t.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+he,0,re,V.width,V.height,0,se,ie,null)}else if(oe){ve&&Ue&&t.texStorage2D(n.TEXTURE_CUBE_MAP,Ae,re,V.width,V.height);for(let he=0;he<6;he++){De=Y[he].mipmaps;for(let qe=0;qe<De.length;qe++){let vt=De[qe];_.format!==Yt?se!==null?ve?ee&&t.compressedTexSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+he,qe,0,0,vt.width,vt.height,se,vt.data):t.compressedTexImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+he,qe,re,vt.width,vt.height,0,vt.data):pe("WebGLRenderer: Attempt to load unsupported compressed texture format in .setTextureCube()"):ve?ee&&t.texSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+he,qe,0,0,vt.width,vt.height,se,ie,vt.data):t.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+he,qe,re,vt.width,vt.height,0,se,ie,vt.data)}}}else{if(De=_.mipmaps,ve&&Ue){De.length>0&&Ae++;let he=Ce(Y[0]);t.texStorage2D(n.TEXTURE_CUBE_MAP,Ae,re,he.width,he.height)}for(let he=0;he<6;he++)if(R){ve?ee&&t.texSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+he,0,0,0,Y[he].width,Y[he].height,se,ie,Y[he].data):t.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+he,0,re,Y[he].width,Y[he].height,0,se,ie,Y[he].data);for(let qe=0;qe<De.length;qe++){let Oi=De[qe].image[he].image;ve?ee&&t.texSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+he,qe+1,0,0,Oi.width,Oi.height,se,ie,Oi.data):t.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+he,qe+1,re,Oi.width,Oi.height,0,se,ie,Oi.data)}}else{ve?ee&&t.texSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+he,0,0,0,se,ie,Y[he]):t.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+he,0,re,se,ie,Y[he]);for(let qe=0;qe<De.length;qe++){let vt=De[qe];ve?ee&&t.texSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+he,qe+1,0,0,se,ie,vt.image[he]):t.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+he,qe+1,re,se,ie,vt.image[he])}}}A(_)&&_.mipmapsAutoUpdate===!0&&M(n.TEXTURE_CUBE_MAP),ne.__version=Z.version,_.onUpdate&&_.onUpdate(_)}E.__version=_.version}function rt(E,_,F,j,Z,ne){let le=o.convert(F.format,F.colorSpace),X=o.convert(F.type),q=b(F.internalFormat,le,X,F.normalized,F.colorSpace),oe=i.get(_),R=i.get(F);if(R.__renderTarget=_,!oe.__hasExternalTextures){let Y=Math.max(1,_.width>>ne),V=Math.max(1,_.height>>ne);Z===n.TEXTURE_3D||Z===n.TEXTURE_2D_ARRAY?t.texImage3D(Z,ne,q,Y,V,_.depth,0,le,X,null):t.texImage2D(Z,ne,q,Y,V,0,le,X,null)}t.bindFramebuffer(n.FRAMEBUFFER,E),fe(_)?a.framebufferTexture2DMultisampleEXT(n.FRAMEBUFFER,j,Z,R.__webglTexture,0,it(_)):(Z===n.TEXTURE_2D||Z>=n.TEXTURE_CUBE_MAP_POSITIVE_X&&Z<=n.TEXTURE_CUBE_MAP_NEGATIVE_Z)&&n.framebufferTexture2D(n.FRAMEBUFFER,j,Z,R.__webglTexture,ne),t.bindFramebuffer(n.FRAMEBUFFER,null)}function Ti(E,_,F){if(n.bindRenderbuffer(n.RENDERBUFFER,E),_.depthBuffer){let j=_.depthTexture,Z=j&&j.isDepthTexture?j.type:null,ne=g(_.stencilBuffer,Z),le=_.stencilBuffer?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT;fe(_)?a.renderbufferStorageMultisampleEXT(n.RENDERBUFFER,it(_),ne,_.width,_.height):F?n.renderbufferStorageMultisample(n.RENDERBUFFER,it(_),ne,_.width,_.height):n.renderbufferStorage(n.RENDERBUFFER,ne,_.width,_.height),n.framebufferRenderbuffer(n.FRAMEBUFFER,le,n.RENDERBUFFER,E)}else{let j=_.textures;for(let Z=0;Z<j.length;Z++){let ne=j[Z],le=o.convert(ne.format,ne.colorSpace),X=o.convert(ne.type),q=b(ne.internalFormat,le,X,ne.normalized,ne.colorSpace);fe(_)?a.renderbufferStorageMultisampleEXT(n.RENDERBUFFER,it(_),q,_.width,_.height):F?n.renderbufferStorageMultisample(n.RENDERBUFFER,it(_),q,_.width,_.height):n.renderbufferStorage(n.RENDERBUFFER,q,_.width,_.height)}}n.bindRenderbuffer(n.RENDERBUFFER,null)}function Mt(E,_,F){let j=_.isWebGLCubeRenderTarget===!0;if(t.bindFramebuffer(n.FRAMEBUFFER,E),!(_.depthTexture&&_.depthTexture.isDepthTexture))throw new Error("THREE.WebGLTextures: renderTarget.depthTexture must be an instance of THREE.DepthTexture.");let Z=i.get(_.depthTexture);Z.__renderTarget=_;let ne=j?_.depthTexture.image[0]:_.depthTexture.image;(!Z.__webglTexture||ne.width!==_.width||ne.height!==_.height)&&(ne.width=_.width,ne.height=_.height,_.depthTexture.needsUpdate=!0),j?Te(_.depthTexture,0):Qe(_.depthTexture,0);let le=Z.__webglTexture,X=it(_),q=j?n.TEXTURE_CUBE_MAP_POSITIVE_X+F:n.TEXTURE_2D,oe=_.depthTexture.format===mi?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT;if(_.depthTexture.format===ci)fe(_)?a.framebufferTexture2DMultisampleEXT(n.FRAMEBUFFER,oe,q,le,0,X):n.framebufferTexture2D(n.FRAMEBUFFER,oe,q,le,0);else if(_.depthTexture.format===mi)fe(_)?a.framebufferTexture2DMultisampleEXT(n.FRAMEBUFFER,oe,q,le,0,X):n.framebufferTexture2D(n.FRAMEBUFFER,oe,q,le,0);else throw new Error("THREE.WebGLTextures: Unknown depthTexture format.")}function ri(E){let _=i.get(E),F=E.isWebGLCubeRenderTarget===!0;if(_.__boundDepthTexture!==E.depthTexture){let j=E.depthTexture;if(_.__depthDisposeCallback&&_.__depthDisposeCallback(),j){let Z=()=>{delete _.__boundDepthTexture,delete _.__depthDisposeCallback,j.removeEventListener("dispose",Z)};j.addEventListener("dispose",Z),_.__depthDisposeCallback=Z}_.__boundDepthTexture=j}if(E.depthTexture&&!_.__autoAllocateDepthBuffer)if(F)for(let j=0;j<6;j++)Mt(_.__webglFramebuffer[j],E,j);else E.texture.mipmaps.length>0?Mt(_.__webglFramebuffer[0],E,0):Mt(_.__webglFramebuffer,E,0);else if(F){_.__webglDepthbuffer=[];for(let j=0;j<6;j++)if(t.bindFramebuffer(n.FRAMEBUFFER,_.__webglFramebuffer[j]),_.__webglDepthbuffer[j]===void 0)_.__webglDepthbuffer[j]=n.createRenderbuffer(),Ti(_.__webglDepthbuffer[j],E,!1);else{let Z=E.stencilBuffer?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT,ne=_.__webglDepthbuffer[j];n.bindRenderbuffer(n.RENDERBUFFER,ne),n.framebufferRenderbuffer(n.FRAMEBUFFER,Z,n.RENDERBUFFER,ne)}}else if(E.texture.mipmaps.length>0?t.bindFramebuffer(n.FRAMEBUFFER,_.__webglFramebuffer[0]):t.bindFramebuffer(n.FRAMEBUFFER,_.__webglFramebuffer),_.__webglDepthbuffer===void 0)_.__webglDepthbuffer=n.createRenderbuffer(),Ti(_.__webglDepthbuffer,E,!1);else{let Z=E.stencilBuffer?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT,ne=_.__webglDepthbuffer;n.bindRenderbuffer(n.RENDERBUFFER,ne),n.framebufferRenderbuffer(n.FRAMEBUFFER,Z,n.RENDERBUFFER,ne)}t.bindFramebuffer(n.FRAMEBUFFER,null)}function oi(E,_,F){let j=i.get(E);_!==void 0&&rt(j.__webglFramebuffer,E,E.texture,n.COLOR_ATTACHMENT0,n.TEXTURE_2D,0),F!==void 0&&ri(E)}function si(E){let _=E.texture,F=i.get(E),j=i.get(_);E.addEventListener("dispose",z),B(E);let Z=E.textures,ne=E.isWebGLCubeRenderTarget===!0,le=Z.length>1;if(le||(j.__webglTexture===void 0&&(j.__webglTexture=n.createTexture()),j.__version=_.version,s.memory.textures++),ne){F.__webglFramebuffer=[];for(let X=0;X<6;X++)if(_.mipmaps.length>0){F.__webglFramebuffer[X]=[];for(let q=0;q<_.mipmaps.length;q++)F.__webglFramebuffer[X][q]=n.createFramebuffer()}else F.__webglFramebuffer[X]=n.createFramebuffer()}else{if(_.mipmaps.length>0){F.__webglFramebuffer=[];for(let X=0;X<_.mipmaps.length;X++)F.__webglFramebuffer[X]=n.createFramebuffer()}else F.__webglFramebuffer=n.createFramebuffer();if(le)for(let X=0,q=Z.length;X<q;X++){let oe=i.get(Z[X]);oe.__webglTexture===void 0&&(oe.__webglTexture=n.createTexture(),s.memory.textures++)}if(E.samples>0&&fe(E)===!1){F.__webglMultisampledFramebuffer=n.createFramebuffer(),F.__webglColorRenderbuffer=[],t.bindFramebuffer(n.FRAMEBUFFER,F.__webglMultisampledFramebuffer);for(let X=0;X<Z.length;X++){let q=Z[X];F.__webglColorRenderbuffer[X]=n.createRenderbuffer(),n.bindRenderbuffer(n.RENDERBUFFER,F.__webglColorRenderbuffer[X]);let oe=o.convert(q.format,q.colorSpace),R=o.convert(q.type),Y=b(q.internalFormat,oe,R,q.normalized,q.colorSpace,E.isXRRenderTarget===!0),V=it(E);n.renderbufferStorageMultisample(n.RENDERBUFFER,V,Y,E.width,E.height),n.framebufferRenderbuffer(n.FRAMEBUFFER,n.COLOR_ATTACHMENT0+X,n.RENDERBUFFER,F.__webglColorRenderbuffer[X])}n.bindRenderbuffer(n.RENDERBUFFER,null),E.depthBuffer&&(F.__webglDepthRenderbuffer=n.createRenderbuffer(),Ti(F.__webglDepthRenderbuffer,E,!0)),t.bindFramebuffer(n.FRAMEBUFFER,null)}}if(ne){t.bindTexture(n.TEXTURE_CUBE_MAP,j.__webglTexture),mt(n.TEXTURE_CUBE_MAP,_);for(let X=0;X<6;X++)if(_.mipmaps.length>0)for(let q=0;q<_.mipmaps.length;q++)rt(F.__webglFramebuffer[X][q],E,_,n.COLOR_ATTACHMENT0,n.TEXTURE_CUBE_MAP_POSITIVE_X+X,q);else rt(F.__webglFramebuffer[X],E,_,n.COLOR_ATTACHMENT0,n.TEXTURE_CUBE_MAP_POSITIVE_X+X,0);A(_)?M(n.TEXTURE_CUBE_MAP):_.mipmaps.length>0&&n.texParameteri(n.TEXTURE_CUBE_MAP,n.TEXTURE_MAX_LEVEL,_.mipmaps.length-1),t.unbindTexture()}else if(le){for(let X=0,q=Z.length;X<q;X++){let oe=Z[X],R=i.get(oe),Y=n.TEXTURE_2D;(E.isWebGL3DRenderTarget||E.isWebGLArrayRenderTarget)&&(Y=E.isWebGL3DRenderTarget?n.TEXTURE_3D:n.TEXTURE_2D_ARRAY),t.bindTexture(Y,R.__webglTexture),mt(Y,oe),rt(F.__webglFramebuffer,E,oe,n.COLOR_ATTACHMENT0+X,Y,0),A(oe)&&M(Y)}t.unbindTexture()}else{let X=n.TEXTURE_2D;if((E.isWebGL3DRenderTarget||E.isWebGLArrayRenderTarget)&&(X=E.isWebGL3DRenderTarget?n.TEXTURE_3D:n.TEXTURE_2D_ARRAY),t.bindTexture(X,j.__webglTexture),mt(X,_),_.mipmaps.length>0)for(let q=0;q<_.mipmaps.length;q++)rt(F.__webglFramebuffer[q],E,_,n.COLOR_ATTACHMENT0,X,q);else rt(F.__webglFramebuffer,E,_,n.COLOR_ATTACHMENT0,X,0);A(_)?M(X):_.mipmaps.length>0&&n.texParameteri(X,n.TEXTURE_MAX_LEVEL,_.mipmaps.length-1),t.unbindTexture()}E.depthBuffer&&ri(E)}function L(E){let _=E.textures;for(let F=0,j=_.length;F<j;F++){let Z=_[F];if(A(Z)&&Z.mipmapsAutoUpdate===!0){let ne=C(E),le=i.get(Z).__webglTexture;t.bindTexture(ne,le),M(ne),t.unbindTexture()}}}let ai=[];function tt(E){if(E.samples>0){if(fe(E)===!1){let _=E.textures,F=E.width,j=E.height,Z=n.COLOR_BUFFER_BIT,ne=E.stencilBuffer?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT,le=i.get(E),X=_.length>1;if(X)for(let oe=0;oe<_.length;oe++)t.bindFramebuffer(n.FRAMEBUFFER,le.__webglMultisampledFramebuffer),n.framebufferRenderbuffer(n.FRAMEBUFFER,n.COLOR_ATTACHMENT0+oe,n.RENDERBUFFER,null),t.bindFramebuffer(n.FRAMEBUFFER,le.__webglFramebuffer),n.framebufferTexture2D(n.DRAW_FRAMEBUFFER,n.COLOR_ATTACHMENT0+oe,n.TEXTURE_2D,null,0);t.bindFramebuffer(n.READ_FRAMEBUFFER,le.__webglMultisampledFramebuffer),E.texture.mipmaps.length>0?t.bindFramebuffer(n.DRAW_FRAMEBUFFER,le.__webglFramebuffer[0]):t.bindFramebuffer(n.DRAW_FRAMEBUFFER,le.__webglFramebuffer);for(let oe=0;oe<_.length;oe++){if(E.resolveDepthBuffer&&(E.depthBuffer&&(Z|=n.DEPTH_BUFFER_BIT),E.stencilBuffer&&E.resolveStencilBuffer&&(Z|=n.STENCIL_BUFFER_BIT)),X){n.framebufferRenderbuffer(n.READ_FRAMEBUFFER,n.COLOR_ATTACHMENT0,n.RENDERBUFFER,le.__webglColorRenderbuffer[oe]);let R=i.get(_[oe]).__webglTexture;n.framebufferTexture2D(n.DRAW_FRAMEBUFFER,n.COLOR_ATTACHMENT0,n.TEXTURE_2D,R,0)}n.blitFramebuffer(0,0,F,j,0,0,F,j,Z,n.NEAREST),c===!0&&(ai.length=0,ai.push(n.COLOR_ATTACHMENT0+oe),E.depthBuffer&&E.storeMultisampledDepthBuffer===!1&&ai.push(ne),n.invalidateFramebuffer(n.READ_FRAMEBUFFER,ai))}if(t.bindFramebuffer(n.READ_FRAMEBUFFER,null),t.bindFramebuffer(n.DRAW_FRAMEBUFFER,null),X)for(let oe=0;oe<_.length;oe++){t.bindFramebuffer(n.FRAMEBUFFER,le.__webglMultisampledFramebuffer),n.framebufferRenderbuffer(n.FRAMEBUFFER,n.COLOR_ATTACHMENT0+oe,n.RENDERBUFFER,le.__webglColorRenderbuffer[oe]);let R=i.get(_[oe]).__webglTexture;t.bindFramebuffer(n.FRAMEBUFFER,le.__webglFramebuffer),n.framebufferTexture2D(n.DRAW_FRAMEBUFFER,n.COLOR_ATTACHMENT0+oe,n.TEXTURE_2D,R,0)}t.bindFramebuffer(n.DRAW_FRAMEBUFFER,le.__webglMultisampledFramebuffer)}else if(E.depthBuffer&&E.storeMultisampledDepthBuffer===!1&&c){let _=E.stencilBuffer?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT;n.invalidateFramebuffer(n.DRAW_FRAMEBUFFER,[_])}}}function it(E){return Math.min(r.maxSamples,E.samples)}function fe(E){let _=i.get(E);return E.samples>0&&e.has("WEBGL_multisampled_render_to_texture")===!0&&_.__useRenderToTexture!==!1}function _t(E){let _=s.render.frame;f.get(E)!==_&&(f.set(E,_),E.update())}function be(E,_){let F=E.colorSpace,j=E.format,Z=E.type;return E.isCompressedTexture===!0||E.isVideoTexture===!0||F!==jr&&F!==fi&&(Re.getTransfer(F)===ze?(j!==Yt||Z!==Tt)&&pe("WebGLTextures: sRGB encoded textures have to use RGBAFormat and UnsignedByteType."):Oe("WebGLTextures: Unsupported texture color space:",F)),_}function Ce(E){return typeof HTMLImageElement<"u"&&E instanceof HTMLImageElement?(l.width=E.naturalWidth||E.width,l.height=E.naturalHeight||E.height):typeof VideoFrame<"u"&&E instanceof VideoFrame?(l.width=E.displayWidth,l.height=E.displayHeight):(l.width=E.width,l.height=E.height),l}this.allocateTextureUnit=Ne,this.resetTextureUnits=J,this.getTextureUnits=Q,this.setTextureUnits=Se,this.setTexture2D=Qe,this.setTexture2DArray=Ye,this.setTexture3D=Ze,this.setTextureCube=Te,this.rebindTextures=oi,this.setupRenderTarget=si,this.updateRenderTargetMipmap=L,this.updateMultisampleRenderTarget=tt,this.setupDepthRenderbuffer=ri,this.setupFrameBufferTexture=rt,this.useMultisampledRTT=fe,this.dispose=W}function od(n,e){function t(i,r=fi){let o,s=Re.getTransfer(r);if(i===Tt)return n.UNSIGNED_BYTE;if(i===Mn)return n.UNSIGNED_SHORT_4_4_4_4;if(i===vn)return n.UNSIGNED_SHORT_5_5_5_1;if(i===Lo)return n.UNSIGNED_INT_5_9_9_9_REV;if(i===Do)return n.UNSIGNED_INT_10F_11F_11F_REV;if(i===Co)return n.BYTE;if(i===Po)return n.SHORT;if(i===wi)return n.UNSIGNED_SHORT;if(i===Sn)return n.INT;if(i===Dt)return n.UNSIGNED_INT;if(i===ut)return n.FLOAT;if(i===It)return n.HALF_FLOAT;if(i===Io)return n.ALPHA;if(i===Uo)return n.RGB;if(i===Yt)return n.RGBA;if(i===ci)return n.DEPTH_COMPONENT;if(i===mi)return n.DEPTH_STENCIL;if(i===En)return n.RED;if(i===Tn)return n.RED_INTEGER;if(i===jt)return n.RG;if(i===yn)return n.RG_INTEGER;if(i===An)return n.RGBA_INTEGER;if(i===bn||i===Rn||i===wn||i===Cn)if(s===ze)if(o=e.get("WEBGL_compressed_texture_s3tc_srgb"),o!==null){if(i===bn)return o.COMPRESSED_SRGB_S3TC_DXT1_EXT;if(i===Rn)return o.COMPRESSED_SRGB_ALPHA_S3TC_DXT1_EXT;if(i===wn)return o.COMPRESSED_SRGB_ALPHA_S3TC_DXT3_EXT;if(i===Cn)return o.COMPRESSED_SRGB_ALPHA_S3TC_DXT5_EXT}else return null;else if(o=e.get("WEBGL_compressed_texture_s3tc"),o!==null){if(i===bn)return o.COMPRESSED_RGB_S3TC_DXT1_EXT;if(i===Rn)return o.COMPRESSED_RGBA_S3TC_DXT1_EXT;if(i===wn)return o.COMPRESSED_RGBA_S3TC_DXT3_EXT;if(i===Cn)return o.COMPRESSED_RGBA_S3TC_DXT5_EXT}else return null;if(i===Tr||i===yr||i===Ar||i===br)if(o=e.get("WEBGL_compressed_texture_pvrtc"),o!==null){if(i===Tr)return o.COMPRESSED_RGB_PVRTC_4BPPV1_IMG;if(i===yr)return o.COMPRESSED_RGB_PVRTC_2BPPV1_IMG;if(i===Ar)return o.COMPRESSED_RGBA_PVRTC_4BPPV1_IMG;if(i===br)return o.COMPRESSED_RGBA_PVRTC_2BPPV1_IMG}else return null;if(i===Rr||i===wr||i===Cr||i===Pr||i===Lr||i===sn||i===Dr)if(o=e.get("WEBGL_compressed_texture_etc"),o!==null){if(i===Rr||i===wr)return s===ze?o.COMPRESSED_SRGB8_ETC2:o.COMPRESSED_RGB8_ETC2;if(i===Cr)return s===ze?o.COMPRESSED_SRGB8_ALPHA8_ETC2_EAC:o.COMPRESSED_RGBA8_ETC2_EAC;if(i===Pr)return o.COMPRESSED_R11_EAC;if(i===Lr)return o.COMPRESSED_SIGNED_R11_EAC;if(i===sn)return o.COMPRESSED_RG11_EAC;if(i===Dr)return o.COMPRESSED_SIGNED_RG11_EAC}else return null;if(i===Ir||i===Ur||i===Nr||i===Fr||i===Or||i===Br||i===Gr||i===zr||i===Hr||i===Vr||i===kr||i===Wr||i===Xr||i===qr)if(o=e.get("WEBGL_compressed_texture_astc"),o!==null){if(i===Ir)return s===ze?o.COMPRESSED_SRGB8_ALPHA8_ASTC_4x4_KHR:o.COMPRESSED_RGBA_ASTC_4x4_KHR;if(i===Ur)return s===ze?o.COMPRESSED_SRGB8_ALPHA8_ASTC_5x4_KHR:o.COMPRESSED_RGBA_ASTC_5x4_KHR;if(i===Nr)return s===ze?o.COMPRESSED_SRGB8_ALPHA8_ASTC_5x5_KHR:o.COMPRESSED_RGBA_ASTC_5x5_KHR;if(i===Fr)return s===ze?o.COMPRESSED_SRGB8_ALPHA8_ASTC_6x5_KHR:o.COMPRESSED_RGBA_ASTC_6x5_KHR;if(i===Or)return s===ze?o.COMPRESSED_SRGB8_ALPHA8_ASTC_6x6_KHR:o.COMPRESSED_RGBA_ASTC_6x6_KHR;if(i===Br)return s===ze?o.COMPRESSED_SRGB8_ALPHA8_ASTC_8x5_KHR:o.COMPRESSED_RGBA_ASTC_8x5_KHR;if(i===Gr)return s===ze?o.COMPRESSED_SRGB8_ALPHA8_ASTC_8x6_KHR:o.COMPRESSED_RGBA_ASTC_8x6_KHR;if(i===zr)return s===ze?o.COMPRESSED_SRGB8_ALPHA8_ASTC_8x8_KHR:o.COMPRESSED_RGBA_ASTC_8x8_KHR;if(i===Hr)return s===ze?o.COMPRESSED_SRGB8_ALPHA8_ASTC_10x5_KHR:o.COMPRESSED_RGBA_ASTC_10x5_KHR;if(i===Vr)return s===ze?o.COMPRESSED_SRGB8_ALPHA8_ASTC_10x6_KHR:o.COMPRESSED_RGBA_ASTC_10x6_KHR;if(i===kr)return s===ze?o.COMPRESSED_SRGB8_ALPHA8_ASTC_10x8_KHR:o.COMPRESSED_RGBA_ASTC_10x8_KHR;if(i===Wr)return s===ze?o.COMPRESSED_SRGB8_ALPHA8_ASTC_10x10_KHR:o.COMPRESSED_RGBA_ASTC_10x10_KHR;if(i===Xr)return s===ze?o.COMPRESSED_SRGB8_ALPHA8_ASTC_12x10_KHR:o.COMPRESSED_RGBA_ASTC_12x10_KHR;if(i===qr)return s===ze?o.COMPRESSED_SRGB8_ALPHA8_ASTC_12x12_KHR:o.COMPRESSED_RGBA_ASTC_12x12_KHR}else return null;if(i===Yr||i===Zr||i===Kr)if(o=e.get("EXT_texture_compression_bptc"),o!==null){if(i===Yr)return s===ze?o.COMPRESSED_SRGB_ALPHA_BPTC_UNORM_EXT:o.COMPRESSED_RGBA_BPTC_UNORM_EXT;if(i===Zr)return o.COMPRESSED_RGB_BPTC_SIGNED_FLOAT_EXT;if(i===Kr)return o.COMPRESSED_RGB_BPTC_UNSIGNED_FLOAT_EXT}else return null;if(i===Jr||i===$r||i===an||i===Qr)if(o=e.get("EXT_texture_compression_rgtc"),o!==null){if(i===Jr)return o.COMPRESSED_RED_RGTC1_EXT;if(i===$r)return o.COMPRESSED_SIGNED_RED_RGTC1_EXT;if(i===an)return o.COMPRESSED_RED_GREEN_RGTC2_EXT;if(i===Qr)return o.COMPRESSED_SIGNED_RED_GREEN_RGTC2_EXT}else return null;return i===Ci?n.UNSIGNED_INT_24_8:n[i]!==void 0?n[i]:null}return{convert:t}}var Zs=class{enabled=!1;isPresenting=!1;cameraAutoUpdate=!1;addEventListener(){}removeEventListener(){}setAnimationLoop(){}dispose(){}getCamera(){}hasDepthSensing(){return!1}getEnvironmentBlendMode(){return null}getDepthSensingMesh(){return null}};var jm=new we,sd=new Ee;sd.set(-1,0,0,0,1,0,0,0,1);function ad(n,e){function t(p,u){p.matrixAutoUpdate===!0&&p.updateMatrix(),u.value.copy(p.matrix)}function i(p,u){u.color.getRGB(p.fogColor.value,Rs(n)),u.isFog?(p.fogNear.value=u.near,p.fogFar.value=u.far):u.isFogExp2&&(p.fogDensity.value=u.density)}function r(p,u,y,A,M){u.isNodeMaterial?u.uniformsNeedUpdate=!1:u.isMeshBasicMaterial?o(p,u):u.isMeshLambertMaterial?(o(p,u),u.envMap&&(p.envMapIntensity.value=u.envMapIntensity)):u.isMeshToonMaterial?(o(p,u),d(p,u)):u.isMeshPhongMaterial?(o(p,u),f(p,u),u.envMap&&(p.envMapIntensity.value=u.envMapIntensity)):u.isMeshStandardMaterial?(o(p,u),h(p,u),u.isMeshPhysicalMaterial&&m(p,u,M)):u.isMeshMatcapMaterial?(o(p,u),x(p,u)):u.isMeshDepthMaterial?o(p,u):u.isMeshDistanceMaterial?(o(p,u),v(p,u)):u.isMeshNormalMaterial?o(p,u):u.isLineBasicMaterial?(s(p,u),u.isLineDashedMaterial&&a(p,u)):u.isPointsMaterial?c(p,u,y,A):u.isSpriteMaterial?l(p,u):u.isShadowMaterial?(p.color.value.copy(u.color),p.opacity.value=u.opacity):u.isShaderMaterial&&(u.uniformsNeedUpdate=!1)}function o(p,u){p.opacity.value=u.opacity,u.color&&p.diffuse.value.copy(u.color),u.emissive&&p.emissive.value.copy(u.emissive).multiplyScalar(u.emissiveIntensity),u.map&&(p.map.value=u.map,t(u.map,p.mapTransform)),u.alphaMap&&(p.alphaMap.value=u.alphaMap,t(u.alphaMap,p.alphaMapTransform)),u.bumpMap&&(p.bumpMap.value=u.bumpMap,t(u.bumpMap,p.bumpMapTransform),p.bumpScale.value=u.bumpScale,u.side===at&&(p.bumpScale.value*=-1)),u.normalMap&&(p.normalMap.value=u.normalMap,t(u.normalMap,p.normalMapTransform),p.normalScale.value.copy(u.normalScale),u.side===at&&p.normalScale.value.negate()),u.displacementMap&&(p.displacementMap.value=u.displacementMap,t(u.displacementMap,p.displacementMapTransform),p.displacementScale.value=u.displacementScale,p.displacementBias.value=u.displacementBias),u.emissiveMap&&(p.emissiveMap.value=u.emissiveMap,t(u.emissiveMap,p.emissiveMapTransform)),u.specularMap&&(p.specularMap.value=u.specularMap,t(u.specularMap,p.specularMapTransform)),u.alphaTest>0&&(p.alphaTest.value=u.alphaTest);let y=e.get(u),A=y.envMap,M=y.envMapRotation;A&&(p.envMap.value=A,p.envMapRotation.value.setFromMatrix4(jm.makeRotationFromEuler(M)).transpose(),A.isCubeTexture&&A.isRenderTargetTexture===!1&&p.envMapRotation.value.premultiply(sd),p.reflectivity.value=u.reflectivity,p.ior.value=u.ior,p.refractionRatio.value=u.refractionRatio),u.lightMap&&(p.lightMap.value=u.lightMap,p.lightMapIntensity.value=u.lightMapIntensity,t(u.lightMap,p.lightMapTransform)),u.aoMap&&(p.aoMap.value=u.aoMap,p.aoMapIntensity.value=u.aoMapIntensity,t(u.aoMap,p.aoMapTransform))}function s(p,u){p.diffuse.value.copy(u.color),p.opacity.value=u.opacity,u.map&&(p.map.value=u.map,t(u.map,p.mapTransform))}function a(p,u){p.dashSize.value=u.dashSize,p.totalSize.value=u.dashSize+u.gapSize,p.scale.value=u.scale}function c(p,u,y,A){p.diffuse.value.copy(u.color),p.opacity.value=u.opacity,p.size.value=u.size*y,p.scale.value=A*.5,u.map&&(p.map.value=u.map,t(u.map,p.uvTransform)),u.alphaMap&&(p.alphaMap.value=u.alphaMap,t(u.alphaMap,p.alphaMapTransform)),u.alphaTest>0&&(p.alphaTest.value=u.alphaTest)}function l(p,u){p.diffuse.value.copy(u.color),p.opacity.value=u.opacity,p.rotation.value=u.rotation,u.map&&(p.map.value=u.map,t(u.map,p.mapTransform)),u.alphaMap&&(p.alphaMap.value=u.alphaMap,t(u.alphaMap,p.alphaMapTransform)),u.alphaTest>0&&(p.alphaTest.value=u.alphaTest)}function f(p,u){p.specular.value.copy(u.specular),p.shininess.value=Math.max(u.shininess,1e-4)}function d(p,u){u.gradientMap&&(p.gradientMap.value=u.gradientMap)}function h(p,u){p.metalness.value=u.metalness,u.metalnessMap&&(p.metalnessMap.value=u.metalnessMap,t(u.metalnessMap,p.metalnessMapTransform)),p.roughness.value=u.roughness,u.roughnessMap&&(p.roughnessMap.value=u.roughnessMap,t(u.roughnessMap,p.roughnessMapTransform)),u.envMap&&(p.envMapIntensity.value=u.envMapIntensity)}function m(p,u,y){p.ior.value=u.ior,u.diffuseRoughness>0&&(p.diffuseRoughness.value=u.diffuseRoughness,u.diffuseRoughnessMap&&(p.diffuseRoughnessMap.value=u.diffuseRoughnessMap,t(u.diffuseRoughnessMap,p.diffuseRoughnessMapTransform))),u.sheen>0&&(p.sheenColor.value.copy(u.sheenColor).multiplyScalar(u.sheen),p.sheenRoughness.value=u.sheenRoughness,u.sheenColorMap&&(p.sheenColorMap.value=u.sheenColorMap,t(u.sheenColorMap,p.sheenColorMapTransform)),u.sheenRoughnessMap&&(p.sheenRoughnessMap.value=u.sheenRoughnessMap,t(u.sheenRoughnessMap,p.sheenRoughnessMapTransform))),u.clearcoat>0&&(p.clearcoat.value=u.clearcoat,p.clearcoatRoughness.value=u.clearcoatRoughness,u.clearcoatMap&&(p.clearcoatMap.value=u.clearcoatMap,t(u.clearcoatMap,p.clearcoatMapTransform)),u.clearcoatRoughnessMap&&(p.clearcoatRoughnessMap.value=u.clearcoatRoughnessMap,t(u.clearcoatRoughnessMap,p.clearcoatRoughnessMapTransform)),u.clearcoatNormalMap&&(p.clearcoatNormalMap.value=u.clearcoatNormalMap,t(u.clearcoatNormalMap,p.clearcoatNormalMapTransform),p.clearcoatNormalScale.value.copy(u.clearcoatNormalScale),u.side===at&&p.clearcoatNormalScale.value.negate())),u.dispersion>0&&(p.dispersion.value=u.dispersion),u.retroreflectivity>0&&(p.retroreflectivity.value=u.retroreflectivity),u.iridescence>0&&(p.iridescence.value=u.iridescence,p.iridescenceIOR.value=u.iridescenceIOR,p.iridescenceThicknessMinimum.value=u.iridescenceThicknessMinimum,p.iridescenceThicknessMaximum.value=u.iridescenceThicknessMaximum,u.iridescenceMap&&(p.iridescenceMap.value=u.iridescenceMap,t(u.iridescenceMap,p.iridescenceMapTransform)),u.iridescenceThicknessMap&&(p.iridescenceThicknessMap.value=u.iridescenceThicknessMap,t(u.iridescenceThicknessMap,p.iridescenceThicknessMapTransform))),u.transmission>0&&(p.transmission.value=u.transmission,p.transmissionSamplerMap.value=y.texture,p.transmissionSamplerSize.value.set(y.width,y.height),u.transmissionMap&&(p.transmissionMap.value=u.transmissionMap,t(u.transmissionMap,p.transmissionMapTransform)),p.thickness.value=u.thickness,u.thicknessMap&&(p.thicknessMap.value=u.thicknessMap,t(u.thicknessMap,p.thicknessMapTransform)),p.attenuationDistance.value=u.attenuationDistance,p.attenuationColor.value.copy(u.attenuationColor)),u.anisotropy>0&&(p.anisotropyVector.value.set(u.anisotropy*Math.cos(u.anisotropyRotation),u.anisotropy*Math.sin(u.anisotropyRotation)),u.anisotropyMap&&(p.anisotropyMap.value=u.anisotropyMap,t(u.anisotropyMap,p.anisotropyMapTransform))),p.specularIntensity.value=u.specularIntensity,p.specularColor.value.copy(u.specularColor),u.specularColorMap&&(p.specularColorMap.value=u.specularColorMap,t(u.specularColorMap,p.specularColorMapTransform)),u.specularIntensityMap&&(p.specularIntensityMap.value=u.specularIntensityMap,t(u.specularIntensityMap,p.specularIntensityMapTransform))}function x(p,u){u.matcap&&(p.matcap.value=u.matcap)}function v(p,u){let y=e.get(u).light;p.referencePosition.value.setFromMatrixPosition(y.matrixWorld),p.nearDistance.value=y.shadow.camera.near,p.farDistance.value=y.shadow.camera.far}return{refreshFogUniforms:i,refreshMaterialUniforms:r}}function ld(n,e,t,i){let r={},o={};function s(y,A){let M=A.program;i.uniformBlockBinding(y,M,r[y.id])}function a(y,A){let M=r[y.id];M===void 0&&(x(y),M=c(y),r[y.id]=M,y.addEventListener("dispose",p));let C=A.program;i.updateUBOMapping(y,C);let b=e.render.frame;o[y.id]!==b&&(l(y),o[y.id]=b)}function c(y){let A=n.createBuffer(),M=y.__size,C=y.usage;return n.bindBuffer(n.UNIFORM_BUFFER,A),n.bufferData(n.UNIFORM_BUFFER,M,C),n.bindBuffer(n.UNIFORM_BUFFER,null),A}function l(y){let A=r[y.id],M=y.uniforms,C=y.__cache;n.bindBuffer(n.UNIFORM_BUFFER,A);for(let b=0,g=M.length;b<g;b++){let T=M[b];if(Array.isArray(T))for(let B=0,D=T.length;B<D;B++)f(T[B],b,B,C);else f(T,b,0,C)}n.bindBuffer(n.UNIFORM_BUFFER,null)}function f(y,A,M,C){if(h(y,A,M,C)===!0){let b=y.__offset,g=y.value;if(Array.isArray(g)){let T=0;for(let B=0;B<g.length;B++){let D=g[B],U=v(D,!0);d(D,y.__data,T),T+=U.storage/Float32Array.BYTES_PER_ELEMENT}}else d(g,y.__data,0);n.bufferSubData(n.UNIFORM_BUFFER,b,y.__data)}}function d(y,A,M){typeof y=="number"||typeof y=="boolean"?A[M]=y:y.isMatrix3?(A[M]=y.elements[0],A[M+1]=y.elements[1],A[M+2]=y.elements[2],A[M+3]=0,A[M+4]=y.elements[3],A[M+5]=y.elements[4],A[M+6]=y.elements[5],A[M+7]=0,A[M+8]=y.elements[6],A[M+9]=y.elements[7],A[M+10]=y.elements[8],A[M+11]=0):ArrayBuffer.isView(y)?A.set(y.subarray(0,A.length-M),M):y.toArray(A,M)}function h(y,A,M,C){let b=y.value,g=A+"_"+M;if(Array.isArray(b)){C[g]===void 0&&(C[g]=[]);let T=C[g],B=!1;for(let D=0;D<b.length;D++)m(b[D],T,D)===!0&&(B=!0);return B}return m(b,C,g)}function m(y,A,M){if(A[M]===void 0)return typeof y=="number"||typeof y=="boolean"?A[M]=y:ArrayBuffer.isView(y)?A[M]=y.slice():A[M]=y.clone(),!0;{let C=A[M];if(typeof y=="number"||typeof y=="boolean"){if(C!==y)return A[M]=y,!0}else{if(ArrayBuffer.isView(y))return!0;if(C.equals(y)===!1)return C.copy(y),!0}}return!1}function x(y){let A=y.uniforms,M=0,C=16;for(let g=0,T=A.length;g<T;g++){let B=Array.isArray(A[g])?A[g]:[A[g]];for(let D=0,U=B.length;D<U;D++){let z=B[D],$=Array.isArray(z.value)?z.value:[z.value],P=Array.isArray(A[g])||Array.isArray(z.value),W=M;for(let H=0,te=$.length;H<te;H++){let k=$[H],J=v(k,P),Q=M%C,Se=Q%J.boundary,Ne=Q+Se;M+=Se,Ne!==0&&C-Ne<J.storage&&(M+=C-Ne),H===0&&(W=M),M+=J.storage}let K=z.type==="int"?Int32Array:z.type==="uint"?Uint32Array:Float32Array;z.__data=new K((M-W)/Float32Array.BYTES_PER_ELEMENT),z.__offset=W}}let b=M%C;return b>0&&(M+=C-b),y.__size=M,y.__cache={},this}function v(y,A){let M={boundary:0,storage:0};return typeof y=="number"||typeof y=="boolean"?(M.boundary=4,M.storage=4):y.isVector2?(M.boundary=8,M.storage=8):y.isVector3||y.isColor?(M.boundary=16,M.storage=12):y.isVector4?(M.boundary=16,M.storage=16):y.isMatrix3?(M.boundary=16,M.storage=48):y.isMatrix4?(M.boundary=16,M.storage=64):y.isTexture?pe("WebGLRenderer: Texture samplers can not be part of an uniforms group."):ArrayBuffer.isView(y)?(M.boundary=16,M.storage=y.byteLength):pe("WebGLRenderer: Unsupported uniform value type.",y),A===!0&&(M.boundary=16,M.storage=Math.ceil(M.storage/16)*16),M}function p(y){let A=y.target;A.removeEventListener("dispose",p),n.deleteBuffer(r[A.id]),delete r[A.id],delete o[A.id]}function u(){for(let y in r)n.deleteBuffer(r[y]);r={},o={}}return{bind:s,update:a,dispose:u}}var eg=new Uint16Array([12469,15057,12620,14925,13266,14620,13807,14376,14323,13990,14545,13625,14713,13328,14840,12882,14931,12528,14996,12233,15039,11829,15066,11525,15080,11295,15085,10976,15082,10705,15073,10495,13880,14564,13898,14542,13977,14430,14158,14124,14393,13732,14556,13410,14702,12996,14814,12596,14891,12291,14937,11834,14957,11489,14958,11194,14943,10803,14921,10506,14893,10278,14858,9960,14484,14039,14487,14025,14499,13941,14524,13740,14574,13468,14654,13106,14743,12678,14818,12344,14867,11893,14889,11509,14893,11180,14881,10751,14852,10428,14812,10128,14765,9754,14712,9466,14764,13480,14764,13475,14766,13440,14766,13347,14769,13070,14786,12713,14816,12387,14844,11957,14860,11549,14868,11215,14855,10751,14825,10403,14782,10044,14729,9651,14666,9352,14599,9029,14967,12835,14966,12831,14963,12804,14954,12723,14936,12564,14917,12347,14900,11958,14886,11569,14878,11247,14859,10765,14828,10401,14784,10011,14727,9600,14660,9289,14586,8893,14508,8533,15111,12234,15110,12234,15104,12216,15092,12156,15067,12010,15028,11776,14981,11500,14942,11205,14902,10752,14861,10393,14812,9991,14752,9570,14682,9252,14603,8808,14519,8445,14431,8145,15209,11449,15208,11451,15202,11451,15190,11438,15163,11384,15117,11274,15055,10979,14994,10648,14932,10343,14871,9936,14803,9532,14729,9218,14645,8742,14556,8381,14461,8020,14365,7603,15273,10603,15272,10607,15267,10619,15256,10631,15231,10614,15182,10535,15118,10389,15042,10167,14963,9787,14883,9447,14800,9115,14710,8665,14615,8318,14514,7911,14411,7507,14279,7198,15314,9675,15313,9683,15309,9712,15298,9759,15277,9797,15229,9773,15166,9668,15084,9487,14995,9274,14898,8910,14800,8539,14697,8234,14590,7790,14479,7409,14367,7067,14178,6621,15337,8619,15337,8631,15333,8677,15325,8769,15305,8871,15264,8940,15202,8909,15119,8775,15022,8565,14916,8328,14804,8009,14688,7614,14569,7287,14448,6888,14321,6483,14088,6171,15350,7402,15350,7419,15347,7480,15340,7613,15322,7804,15287,7973,15229,8057,15148,8012,15046,7846,14933,7611,14810,7357,14682,7069,14552,6656,14421,6316,14251,5948,14007,5528,15356,5942,15356,5977,15353,6119,15348,6294,15332,6551,15302,6824,15249,7044,15171,7122,15070,7050,14949,6861,14818,6611,14679,6349,14538,6067,14398,5651,14189,5311,13935,4958,15359,4123,15359,4153,15356,4296,15353,4646,15338,5160,15311,5508,15263,5829,15188,6042,15088,6094,14966,6001,14826,5796,14678,5543,14527,5287,14377,4985,14133,4586,13869,4257,15360,1563,15360,1642,15358,2076,15354,2636,15341,3350,15317,4019,15273,4429,15203,4732,15105,4911,14981,4932,14836,4818,14679,4621,14517,4386,14359,4156,14083,3795,13808,3437,15360,122,15360,137,15358,285,15355,636,15344,1274,15322,2177,15281,2765,15215,3223,15120,3451,14995,3569,14846,3567,14681,3466,14511,3305,14344,3121,14037,2800,13753,2467,15360,0,15360,1,15359,21,15355,89,15346,253,15325,479,15287,796,15225,1148,15133,1492,15008,1749,14856,1882,14685,1886,14506,1783,14324,1608,13996,1398,13702,1183]),bi=null;function cd(){return bi===null&&(bi=new Ki(eg,16,16,jt,It),bi.name="DFG_LUT",bi.minFilter=ft,bi.magFilter=ft,bi.wrapS=qt,bi.wrapT=qt,bi.generateMipmaps=!1,bi.needsUpdate=!0),bi}var Ks=class{constructor(e={}){let{canvas:t=Ol(),context:i=null,depth:r=!0,stencil:o=!1,alpha:s=!1,antialias:a=!1,premultipliedAlpha:c=!0,preserveDrawingBuffer:l=!1,powerPreference:f="default",failIfMajorPerformanceCaveat:d=!1,reversedDepthBuffer:h=!1,outputBufferType:m=Tt}=e;this.isWebGLRenderer=!0;let x;if(i!==null){if(typeof WebGLRenderingContext<"u"&&i instanceof WebGLRenderingContext)throw new Error("THREE.WebGLRenderer: WebGL 1 is not supported since r163.");x=i.getContextAttributes().alpha}else x=s;let v=m,p=new Set([An,yn,Tn]),u=new Set([Tt,Dt,wi,Ci,Mn,vn]),y=new Uint32Array(4),A=new Int32Array(4),M={textures:[],min:[],max:[],resolution:[]},C=null,b=null,g=[],T=[],B=null;this.domElement=t,this.debug={checkShaderErrors:!0,diagnostics:{keywords:!1},onShaderError:null},this.autoClear=!0,this.autoClearColor=!0,this.autoClearDepth=!0,this.autoClearStencil=!0,this.sortObjects=!0,this.clippingPlanes=[],this.localClippingEnabled=!1,this.toneMapping=Xt,this.toneMappingExposure=1,this.transmissionResolutionScale=1;let D=this,U=!1,z=null,$=null,P=null,W=null;this._outputColorSpace=Ht;let K=0,H=0,te=null,k=-1,J=null,Q=new We,Se=new We,Ne=null,Fe=new Me(0),Qe=0,Ye=t.width,Ze=t.height,Te=1,Ke=null,pt=null,Ve=new We(0,0,Ye,Ze),mt=new We(0,0,Ye,Ze),Gt=!1,bt=new ii,Qt=new hs,gt=!1,kt=!1,rt=new we,Ti=new I,Mt=new We,ri={background:null,fog:null,environment:null,overrideMaterial:null,isScene:!0},oi=!1;function si(){return te===null?Te:1}let L=i;function ai(S,w){return t.getContext(S,w)}let tt,it,fe,_t,be,Ce,E,_,F,j,Z,ne,le,X,q,oe,R,Y,V,se,ie,re,ve;try{let S={alpha:!0,depth:r,stencil:o,antialias:a,premultipliedAlpha:c,preserveDrawingBuffer:l,powerPreference:f,failIfMajorPerformanceCaveat:d};if("setAttribute"in t&&t.setAttribute("data-engine",`three.js r${"187"}`),t.addEventListener("webglcontextlost",Ae,!1),t.addEventListener("webglcontextrestored",De,!1),t.addEventListener("webglcontextcreationerror",he,!1),L===null){let w="webgl2";if(L=ai(w,S),L===null)throw ai(w)?new Error("THREE.WebGLRenderer: Error creating WebGL context with your selected attributes."):new Error("THREE.WebGLRenderer: Error creating WebGL context.")}Ue()}catch(S){throw t.removeEventListener("webglcontextlost",Ae,!1),t.removeEventListener("webglcontextrestored",De,!1),t.removeEventListener("webglcontextcreationerror",he,!1),Oe("WebGLRenderer: "+S.message),S}function Ue(){tt=new Sh(L),tt.init(),ie=new od(L,tt),it=new gh(L,tt,e,ie),fe=new nd(L,tt),it.reversedDepthBuffer&&h&&fe.buffers.depth.setReversed(!0),$=L.createFramebuffer(),P=L.createFramebuffer(),W=L.createFramebuffer(),_t=new Eh(L),be=new qh,Ce=new rd(L,tt,fe,be,it,ie,_t),E=new xh(D),_=new Lc(L),re=new ph(L,_),F=new Mh(L,_,_t,re),j=new yh(L,F,_,re,_t),Y=new Th(L,it,Ce),q=new _h(be),Z=new Xh(D,E,tt,it,re,q),ne=new ad(D,be),le=new Kh,X=new Qh(tt),R=new dh(D,E,fe,j,x,c),oe=new id(D,j,it),ve=new ld(L,_t,it,fe),V=new mh(L,tt,_t),se=new vh(L,tt,_t),_t.programs=Z.programs,D.capabilities=it,D.extensions=tt,D.properties=be,D.renderLists=le,D.shadowMap=oe,D.state=fe,D.info=_t}v!==Tt&&(B=new Ah(v,t.width,t.height,a,r,o));let ee=new Zs(D,L);this.xr=ee,this.getContext=function(){return L},this.getContextAttributes=function(){return L.getContextAttributes()},this.forceContextLoss=function(){let S=tt.get("WEBGL_lose_context");S&&S.loseContext()},this.forceContextRestore=function(){let S=tt.get("WEBGL_lose_context");S&&S.restoreContext()},this.getPixelRatio=function(){return Te},this.setPixelRatio=function(S){S!==void 0&&(Te=S,this.setSize(Ye,Ze,!1))},this.getSize=function(S){return S.set(Ye,Ze)},this.setSize=function(S,w,G=!0){if(ee.isPresenting){pe("WebGLRenderer: Can't change size while VR device is presenting.");return}Ye=S,Ze=w,t.width=Math.floor(S*Te),t.height=Math.floor(w*Te),G===!0&&(t.style.width=S+"px",t.style.height=w+"px"),B!==null&&B.setSize(t.width,t.height),this.setViewport(0,0,S,w)},this.getDrawingBufferSize=function(S){return S.set(Ye*Te,Ze*Te).floor()},this.setDrawingBufferSize=function(S,w,G){Ye=S,Ze=w,Te=G,t.width=Math.floor(S*G),t.height=Math.floor(w*G),this.setViewport(0,0,S,w)},this.setEffects=function(S){if(v===Tt){Oe("WebGLRenderer: setEffects() requires outputBufferType set to HalfFloatType or FloatType.");return}if(S){for(let w=0;w<S.length;w++)if(S[w].isOutputPass===!0){pe("WebGLRenderer: OutputPass is not needed in setEffects(). Tone mapping and color space conversion are applied automatically.");break}}B.setEffects(S||[])},this.getCurrentViewport=function(S){return S.copy(Q)},this.getViewport=function(S){return S.copy(Ve)},this.setViewport=function(S,w,G,N){S.isVector4?Ve.set(S.x,S.y,S.z,S.w):Ve.set(S,w,G,N),fe.viewport(Q.copy(Ve).multiplyScalar(si()).round())},this.getScissor=function(S){return S.copy(mt)},this.setScissor=function(S,w,G,N){S.isVector4?mt.set(S.x,S.y,S.z,S.w):mt.set(S,w,G,N),fe.scissor(Se.copy(mt).multiplyScalar(si()).round())},this.getScissorTest=function(){return Gt},this.setScissorTest=function(S){fe.setScissorTest(Gt=S)},this.setOpaqueSort=function(S){Ke=S},this.setTransparentSort=function(S){pt=S},this.getClearColor=function(S){return S.copy(R.getClearColor())},this.setClearColor=function(){R.setClearColor(...arguments)},this.getClearAlpha=function(){return R.getClearAlpha()},this.setClearAlpha=function(){R.setClearAlpha(...arguments)},this.clear=function(S=!0,w=!0,G=!0){let N=0;if(S){let O=!1;if(te!==null){let ce=te.texture.format;O=p.has(ce)}if(O){let ce=te.texture.type,me=u.has(ce),ae=R.getClearColor(),de=R.getClearAlpha(),xe=ae.r,Le=ae.g,Be=ae.b;me?(y[0]=xe,y[1]=Le,y[2]=Be,y[3]=de,L.clearBufferuiv(L.COLOR,0,y)):(A[0]=xe,A[1]=Le,A[2]=Be,A[3]=de,L.clearBufferiv(L.COLOR,0,A))}else N|=L.COLOR_BUFFER_BIT}w&&(N|=L.DEPTH_BUFFER_BIT,this.state.buffers.depth.setMask(!0)),G&&(N|=L.STENCIL_BUFFER_BIT,this.state.buffers.stencil.setMask(4294967295)),N!==0&&L.clear(N)},this.clearColor=function(){this.clear(!0,!1,!1)},this.clearDepth=function(){this.clear(!1,!0,!1)},this.clearStencil=function(){this.clear(!1,!1,!0)},this.setNodesHandler=function(S){S.setRenderer(this),z=S},this.dispose=function(){t.removeEventListener("webglcontextlost",Ae,!1),t.removeEventListener("webglcontextrestored",De,!1),t.removeEventListener("webglcontextcreationerror",he,!1),R.dispose(),le.dispose(),X.dispose(),Ce.dispose(),be.dispose(),E.dispose(),j.dispose(),F.dispose(),re.dispose(),ve.dispose(),Z.dispose(),ee.dispose(),ee.removeEventListener("sessionstart",qa),ee.removeEventListener("sessionend",Ya),ji.stop()};function Ae(S){S.preventDefault(),ra("WebGLRenderer: Context Lost."),U=!0}function De(){ra("WebGLRenderer: Context Restored."),U=!1;let S=_t.autoReset,w=oe.enabled,G=oe.autoUpdate,N=oe.needsUpdate,O=oe.type;Ue(),_t.autoReset=S,oe.enabled=w,oe.autoUpdate=G,oe.needsUpdate=N,oe.type=O}function he(S){Oe("WebGLRenderer: A WebGL context could not be created. Reason: ",S.statusMessage)}function qe(S){let w=S.target;w.removeEventListener("dispose",qe),vt(w)}function vt(S){Oi(S),be.remove(S)}function Oi(S){let w=be.get(S).programs;w!==void 0&&(w.forEach(function(G){Z.releaseProgram(G)}),S.isShaderMaterial&&Z.releaseShaderCache(S))}this.renderBufferDirect=function(S,w,G,N,O,ce){w===null&&(w=ri);let me=O.isMesh&&O.matrixWorld.determinantAffine()<0,ae=hd(S,w,G,N,O);fe.setMaterial(N,me);let de=G.index,xe=1;if(N.wireframe===!0){if(de=F.getWireframeAttribute(G),de===void 0)return;xe=2}let Le=G.drawRange,Be=G.attributes.position,ge=Le.start*xe,Ge=(Le.start+Le.count)*xe;ce!==null&&(ge=Math.max(ge,ce.start*xe),Ge=Math.min(Ge,(ce.start+ce.count)*xe)),de!==null?(ge=Math.max(ge,0),Ge=Math.min(Ge,de.count)):Be!=null&&(ge=Math.max(ge,0),Ge=Math.min(Ge,Be.count));let ct=Ge-ge;if(ct<0||ct===1/0)return;re.setup(O,N,ae,G,de);let je,Je=V;if(de!==null&&(je=_.get(de),Je=se,Je.setIndex(je)),O.isMesh)N.wireframe===!0?(fe.setLineWidth(N.wireframeLinewidth*si()),Je.setMode(L.LINES)):Je.setMode(L.TRIANGLES);else if(O.isLine){let Pt=N.linewidth;Pt===void 0&&(Pt=1),fe.setLineWidth(Pt*si()),O.isLineSegments?Je.setMode(L.LINES):O.isLineLoop?Je.setMode(L.LINE_LOOP):Je.setMode(L.LINE_STRIP)}else O.isPoints?Je.setMode(L.POINTS):O.isSprite&&Je.setMode(L.TRIANGLES);if(O.isBatchedMesh)if(tt.get("WEBGL_multi_draw"))Je.renderMultiDraw(O._multiDrawStarts,O._multiDrawCounts,O._multiDrawCount);else{let Pt=O._multiDrawStarts,_e=O._multiDrawCounts,zt=O._multiDrawCount,ke=de?_.get(de).bytesPerElement:1,en=be.get(N).currentProgram.getUniforms();for(let Lt=0;Lt<zt;Lt++)en.setValue(L,"_gl_DrawID",Lt),Je.render(Pt[Lt]/ke,_e[Lt])}else if(O.isInstancedMesh)Je.renderInstances(ge,ct,O.count);else if(G.isInstancedBufferGeometry){let Pt=G._maxInstanceCount!==void 0?G._maxInstanceCount:1/0,_e=Math.min(G.instanceCount,Pt);Je.renderInstances(ge,ct,_e)}else Je.render(ge,ct)};function Xa(S,w,G,N){z!==null&&S.isNodeMaterial&&z.setObject(N,S),gt===!0&&q.setState(S,G,!1),S.transparent===!0&&S.side===Wt&&S.forceSinglePass===!1?(S.side=at,S.needsUpdate=!0,fr(S,w,N),S.side=li,S.needsUpdate=!0,fr(S,w,N),S.side=Wt):fr(S,w,N)}this.compile=function(S,w,G=null){G===null&&(G=S),z!==null&&z.renderStart(S,w,G),b=X.get(G),b.init(w),T.push(b),G.traverseVisible(function(O){O.isLight&&O.layers.test(w.layers)&&(b.pushLight(O),O.castShadow&&b.pushShadow(O))}),S!==G&&S.traverseVisible(function(O){O.isLight&&O.layers.test(w.layers)&&(b.pushLight(O),O.castShadow&&b.pushShadow(O))}),b.setupLights(),z!==null&&z.updateLights(b.state.lightsArray),kt=this.localClippingEnabled,gt=q.init(this.clippingPlanes,kt),gt===!0&&q.setGlobalState(this.clippingPlanes,w),z!==null&&oe.render(b.state.shadowsArray,G,w);let N=new Set;return S.traverse(function(O){if(!(O.isMesh||O.isPoints||O.isLine||O.isSprite))return;let ce=O.material;if(ce)if(Array.isArray(ce))for(let me=0;me<ce.length;me++){let ae=ce[me];Xa(ae,G,w,O),N.add(ae)}else Xa(ce,G,w,O),N.add(ce)}),b=T.pop(),z!==null&&z.renderEnd(),N},this.compileAsync=function(S,w,G=null){let N=this.compile(S,w,G);return new Promise(O=>{function ce(){if(N.forEach(function(me){let de=be.get(me).currentProgram;(de===void 0||de.isReady())&&N.delete(me)}),N.size===0){O(S);return}setTimeout(ce,10)}tt.get("KHR_parallel_shader_compile")!==null?ce():setTimeout(ce,10)})};let Js=null;function fd(S){Js&&Js(S)}function qa(){ji.stop()}function Ya(){ji.start()}let ji=new Pc;ji.setAnimationLoop(fd),typeof self<"u"&&ji.setContext(self),this.setAnimationLoop=function(S){Js=S,ee.setAnimationLoop(S),S===null?ji.stop():ji.start()},ee.addEventListener("sessionstart",qa),ee.addEventListener("sessionend",Ya),this.render=function(S,w){if(w!==void 0&&w.isCamera!==!0){Oe("WebGLRenderer.render: camera is not an instance of THREE.Camera.");return}if(U===!0)return;z!==null&&z.renderStart(S,w);let G=ee.enabled===!0&&ee.isPresenting===!0,N=B!==null&&(te===null||G)&&B.begin(D,te);if(S.matrixWorldAutoUpdate===!0&&S.updateMatrixWorld(),w.parent===null&&w.matrixWorldAutoUpdate===!0&&w.updateMatrixWorld(),ee.enabled===!0&&ee.isPresenting===!0&&(B===null||B.isCompositing()===!1)&&(ee.cameraAutoUpdate===!0&&ee.updateCamera(w),w=ee.getCamera()),S.isScene===!0&&S.onBeforeRender(D,S,w,te),b=X.get(S,T.length),b.init(w),b.state.textureUnits=Ce.getTextureUnits(),T.push(b),rt.multiplyMatrices(w.projectionMatrix,w.matrixWorldInverse),w.isArrayCamera?Qt.setFromArrayCamera(w):bt.setFromProjectionMatrix(rt,wt,w.reversedDepth),kt=this.localClippingEnabled,gt=q.init(this.clippingPlanes,kt),C=le.get(S,g.length),C.init(),g.push(C),this.info.render.frame++,ee.enabled===!0&&ee.isPresenting===!0){let me=D.xr.getDepthSensingMesh();me!==null&&$s(me,w,-1/0,D.sortObjects)}$s(S,w,0,D.sortObjects),C.finish(),z!==null&&z.updateLights(b.state.lightsArray),D.sortObjects===!0&&C.sort(Ke,pt),oi=ee.enabled===!1||ee.isPresenting===!1||ee.hasDepthSensing()===!1,oi&&R.addToRenderList(C,S),this.info.autoReset===!0&&this.info.reset(),gt===!0&&q.beginShadows();let O=b.state.shadowsArray;if(oe.render(O,S,w),gt===!0&&q.endShadows(),(N&&B.hasRenderPass())===!1){let me=C.opaque,ae=C.transmissive;if(b.setupLights(),w.isArrayCamera){let de=w.cameras;if(ae.length>0)for(let xe=0,Le=de.length;xe<Le;xe++){let Be=de[xe];Ka(me,ae,S,Be)}oi&&R.render(S);for(let xe=0,Le=de.length;xe<Le;xe++){let Be=de[xe];Za(C,S,Be,Be.viewport)}}else ae.length>0&&Ka(me,ae,S,w),oi&&R.render(S),Za(C,S,w)}te!==null&&H===0&&(Ce.updateMultisampleRenderTarget(te),Ce.updateRenderTargetMipmap(te)),N&&B.end(D),S.isScene===!0&&S.onAfterRender(D,S,w),re.resetDefaultState(),k=-1,J=null,T.pop(),T.length>0?(b=T[T.length-1],Ce.setTextureUnits(b.state.textureUnits),gt===!0&&q.setGlobalState(D.clippingPlanes,b.state.camera)):b=null,g.pop(),g.length>0?C=g[g.length-1]:C=null,z!==null&&z.renderEnd()};function $s(S,w,G,N){if(S.visible===!1)return;if(S.layers.test(w.layers)){if(S.isGroup)G=S.renderOrder;else if(S.isLOD)S.autoUpdate===!0&&S.update(w);else if(S.isLight)b.pushLight(S),S.castShadow&&b.pushShadow(S);else if(S.isSprite){let me=w.isArrayCamera?Qt:bt;if(!S.frustumCulled||S.intersectsFrustum(me)){N&&Mt.setFromMatrixPosition(S.matrixWorld).applyMatrix4(rt);let ae=j.update(S),de=S.material;de.visible&&C.push(S,ae,de,G,Mt.z,null,w)}}else if(S.isMesh||S.isLine||S.isPoints){let me=w.isArrayCamera?Qt:bt;if(!S.frustumCulled||S.intersectsFrustum(me)){let ae=j.update(S),de=S.material;if(N&&(S.boundingSphere!==void 0?(S.boundingSphere===null&&S.computeBoundingSphere(),Mt.copy(S.boundingSphere.center)):(ae.boundingSphere===null&&ae.computeBoundingSphere(),Mt.copy(ae.boundingSphere.center)),Mt.applyMatrix4(S.matrixWorld).applyMatrix4(rt)),Array.isArray(de)){let xe=ae.groups;for(let Le=0,Be=xe.length;Le<Be;Le++){let ge=xe[Le],Ge=de[ge.materialIndex];Ge&&Ge.visible&&C.push(S,ae,Ge,G,Mt.z,ge,w)}}else de.visible&&C.push(S,ae,de,G,Mt.z,null,w)}}}let ce=S.children;for(let me=0,ae=ce.length;me<ae;me++)$s(ce[me],w,G,N)}function Za(S,w,G,N){let{opaque:O,transmissive:ce,transparent:me}=S;b.setupLightsView(G),gt===!0&&q.setGlobalState(D.clippingPlanes,G),N&&fe.viewport(Q.copy(N)),O.length>0&&go(O,w,G),ce.length>0&&go(ce,w,G),me.length>0&&go(me,w,G),fe.buffers.depth.setTest(!0),fe.buffers.depth.setMask(!0),fe.buffers.color.setMask(!0),fe.setPolygonOffset(!1)}function Ka(S,w,G,N){if((G.isScene===!0?G.overrideMaterial:null)!==null)return;if(b.state.transmissionRenderTarget[N.id]===void 0){let ge=tt.has("EXT_color_buffer_half_float")||tt.has("EXT_color_buffer_float");b.state.transmissionRenderTarget[N.id]=new Nt(1,1,{generateMipmaps:!0,type:ge?It:Tt,minFilter:pi,samples:Math.max(4,it.samples),stencilBuffer:o,resolveDepthBuffer:!1,resolveStencilBuffer:!1,storeMultisampledDepthBuffer:!1,storeMultisampledStencilBuffer:!1,colorSpace:Re.workingColorSpace})}let ce=b.state.transmissionRenderTarget[N.id],me=N.viewport||Q;ce.setSize(me.z*D.transmissionResolutionScale,me.w*D.transmissionResolutionScale);let ae=D.getRenderTarget(),de=D.getActiveCubeFace(),xe=D.getActiveMipmapLevel();D.setRenderTarget(ce),D.getClearColor(Fe),Qe=D.getClearAlpha(),Qe<1&&D.setClearColor(16777215,.5),D.clear(),oi&&R.render(G);let Le=D.toneMapping;D.toneMapping=Xt;let Be=N.viewport;if(N.viewport!==void 0&&(N.viewport=void 0),b.setupLightsView(N),gt===!0&&q.setGlobalState(D.clippingPlanes,N),go(S,G,N),Ce.updateMultisampleRenderTarget(ce),Ce.updateRenderTargetMipmap(ce),tt.has("WEBGL_multisampled_render_to_texture")===!1){let ge=!1;for(let Ge=0,ct=w.length;Ge<ct;Ge++){let je=w[Ge],{object:Je,geometry:Pt,material:_e,group:zt}=je;if(_e.side===Wt&&Je.layers.test(N.layers)){let ke=_e.side;_e.side=at,_e.needsUpdate=!0,Ja(Je,G,N,Pt,_e,zt),_e.side=ke,_e.needsUpdate=!0,ge=!0}}ge===!0&&(Ce.updateMultisampleRenderTarget(ce),Ce.updateRenderTargetMipmap(ce))}D.setRenderTarget(ae,de,xe),D.setClearColor(Fe,Qe),Be!==void 0&&(N.viewport=Be),D.toneMapping=Le}function go(S,w,G){let N=w.isScene===!0?w.overrideMaterial:null;for(let O=0,ce=S.length;O<ce;O++){let me=S[O],{object:ae,geometry:de,group:xe}=me,Le=me.material;Le.allowOverride===!0&&N!==null&&(Le=N),ae.layers.test(G.layers)&&Ja(ae,w,G,de,Le,xe)}}function Ja(S,w,G,N,O,ce){z!==null&&O.isNodeMaterial&&z.setObject(S,O),S.onBeforeRender(D,w,G,N,O,ce),S.modelViewMatrix.multiplyMatrices(G.matrixWorldInverse,S.matrixWorld),S.normalMatrix.getNormalMatrix(S.modelViewMatrix),O.onBeforeRender(D,w,G,N,S,ce),O.transparent===!0&&O.side===Wt&&O.forceSinglePass===!1?(O.side=at,O.needsUpdate=!0,D.renderBufferDirect(G,w,N,O,S,ce),O.side=li,O.needsUpdate=!0,D.renderBufferDirect(G,w,N,O,S,ce),O.side=Wt):D.renderBufferDirect(G,w,N,O,S,ce),S.onAfterRender(D,w,G,N,O,ce)}function $a(S){let w=0;for(let G of S)G.texture!==null&&w++;return w}function fr(S,w,G){w.isScene!==!0&&(w=ri);let N=be.get(S),O=b.state.lights,ce=b.state.shadowsArray,me=O.state.version,ae=Z.getParameters(S,O.state,ce,w,G,b.state.lightProbeGridArray),de=Z.getProgramCacheKey(ae),xe=N.programs;N.environment=S.isMeshStandardMaterial||S.isMeshLambertMaterial||S.isMeshPhongMaterial?w.environment:null,N.fog=w.fog;let Le=S.isMeshStandardMaterial||S.isMeshLambertMaterial&&!S.envMap||S.isMeshPhongMaterial&&!S.envMap;N.envMap=E.get(S.envMap||N.environment,Le),N.envMapRotation=N.environment!==null&&S.envMap===null?w.environmentRotation:S.envMapRotation,xe===void 0&&(S.addEventListener("dispose",qe),xe=new Map,N.programs=xe,N.programVariants=new Map);let Be=xe.get(de);if(Be!==void 0){if(N.currentProgram===Be&&N.lightsStateVersion===me)return ja(S,ae),Be}else ae.uniforms=Z.getUniforms(S),z!==null&&S.isNodeMaterial&&z.build(S,G,ae),S.onBeforeCompile(ae,D),Be=Z.acquireProgram(ae,de),xe.set(de,Be),N.uniforms=ae.uniforms;let ge=N.uniforms;return(!S.isShaderMaterial&&!S.isRawShaderMaterial||S.clipping===!0)&&(ge.clippingPlanes=q.uniform),ja(S,ae),N.needsLights=pd(S),N.lightsStateVersion=me,N.needsLights&&(ge.ambientLightColor.value=O.state.ambient,ge.lightProbe.value=O.state.probe,ge.sunLights.value=O.state.sun,ge.sunLightShadows.value=O.state.sunShadow,ge.directionalLights.value=O.state.directional,ge.directionalLightShadows.value=O.state.directionalShadow,ge.spotLights.value=O.state.spot,ge.spotLightShadows.value=O.state.spotShadow,ge.rectAreaLights.value=O.state.rectArea,ge.ltc_1.value=O.state.rectAreaLTC1,ge.ltc_2.value=O.state.rectAreaLTC2,ge.pointLights.value=O.state.point,ge.pointLightShadows.value=O.state.pointShadow,ge.hemisphereLights.value=O.state.hemi,ge.sunShadowMatrix.value=O.state.sunShadowMatrix,ge.sunShadowCascade.value=O.state.sunShadowCascade,ge.directionalShadowMatrix.value=O.state.directionalShadowMatrix,ge.spotLightMatrix.value=O.state.spotLightMatrix,ge.spotLightMap.value=O.state.spotLightMap,ge.pointShadowMatrix.value=O.state.pointShadowMatrix),N.numLightProbeGrids=$a(b.state.lightProbeGridArray),N.currentProgram=Be,N.uniformsList=null,Be}function ud(S,w,G,N,O){let ce=be.get(S),me=ce.currentProgram.id+","+N+","+O,ae=ce.programVariants.get(me);return ae===void 0?(ae=fr(S,w,G),ce.programVariants.set(me,ae)):(ce.currentProgram=ae,ce.uniformsList=null,ce.outputColorSpace=N,ce.toneMapping=O),ae}function Qa(S){if(S.uniformsList===null){let w=S.currentProgram.getUniforms();S.uniformsList=Qi.seqWithValue(w.seq,S.uniforms)}return S.uniformsList}function ja(S,w){let G=be.get(S);G.outputColorSpace=w.outputColorSpace,G.batching=w.batching,G.batchingColor=w.batchingColor,G.instancing=w.instancing,G.instancingColor=w.instancingColor,G.instancingMorph=w.instancingMorph,G.skinning=w.skinning,G.morphTargets=w.morphTargets,G.morphNormals=w.morphNormals,G.morphColors=w.morphColors,G.morphTargetsCount=w.morphTargetsCount,G.numClippingPlanes=w.numClippingPlanes,G.numIntersection=w.numClipIntersection,G.vertexAlphas=w.vertexAlphas,G.vertexTangents=w.vertexTangents,G.toneMapping=w.toneMapping}function hd(S,w,G,N,O){w.isScene!==!0&&(w=ri),Ce.resetTextureUnits();let ce=w.fog,me=N.isMeshStandardMaterial||N.isMeshLambertMaterial||N.isMeshPhongMaterial?w.environment:null,ae=te===null?D.outputColorSpace:te.isXRRenderTarget===!0?te.texture.colorSpace:Re.workingColorSpace,de=N.isMeshStandardMaterial||N.isMeshLambertMaterial&&!N.envMap||N.isMeshPhongMaterial&&!N.envMap,xe=E.get(N.envMap||me,de),Le=N.vertexColors===!0&&!!G.attributes.color&&G.attributes.color.itemSize===4,Be=!!G.attributes.tangent&&(!!N.normalMap||N.anisotropy>0),ge=!!G.morphAttributes.position,Ge=!!G.morphAttributes.normal,ct=!!G.morphAttributes.color,je=Xt;N.toneMapped&&(te===null||te.isXRRenderTarget===!0)&&(je=D.toneMapping);let Je=G.morphAttributes.position||G.morphAttributes.normal||G.morphAttributes.color,Pt=Je!==void 0?Je.length:0,_e=be.get(N),zt=b.state.lights;if(gt===!0&&(kt===!0||S!==J)){let ot=S===J&&N.id===k;q.setState(N,S,ot)}let ke=!1,en=!1;N.version===_e.__version?_e.needsLights&&_e.lightsStateVersion!==zt.state.version||O.isBatchedMesh&&_e.batching===!1||!O.isBatchedMesh&&_e.batching===!0||O.isBatchedMesh&&_e.batchingColor===!0&&O._colorsTexture===null||O.isBatchedMesh&&_e.batchingColor===!1&&O._colorsTexture!==null||O.isInstancedMesh&&_e.instancing===!1||!O.isInstancedMesh&&_e.instancing===!0||O.isSkinnedMesh&&_e.skinning===!1||!O.isSkinnedMesh&&_e.skinning===!0||O.isInstancedMesh&&_e.instancingColor===!0&&O.instanceColor===null||O.isInstancedMesh&&_e.instancingColor===!1&&O.instanceColor!==null||O.isInstancedMesh&&_e.instancingMorph===!0&&O.morphTexture===null||O.isInstancedMesh&&_e.instancingMorph===!1&&O.morphTexture!==null||_e.envMap!==xe||N.fog===!0&&_e.fog!==ce||_e.numClippingPlanes!==void 0&&(_e.numClippingPlanes!==q.numPlanes||_e.numIntersection!==q.numIntersection)||_e.vertexAlphas!==Le||_e.vertexTangents!==Be||_e.morphTargets!==ge||_e.morphNormals!==Ge||_e.morphColors!==ct||_e.morphTargetsCount!==Pt||_e.numLightProbeGrids!==$a(b.state.lightProbeGridArray)?ke=!0:(_e.outputColorSpace!==ae||_e.toneMapping!==je)&&(en=!0):(ke=!0,_e.__version=N.version);let Lt=_e.currentProgram;(ke===!0||en===!0)&&(Lt=en===!0?ud(N,w,O,ae,je):fr(N,w,O),z&&N.isNodeMaterial&&z.onUpdateProgram(N,Lt,_e));let _o=!1,Bi=!1,tn=!1,He=Lt.getUniforms(),Rt=_e.uniforms;if(fe.useProgram(Lt.program)&&(_o=!0,Bi=!0,tn=!0),N.id!==k&&(k=N.id,Bi=!0),_o||J!==S){fe.buffers.depth.getReversed()&&S.reversedDepth!==!0&&(S._reversedDepth=!0,S.updateProjectionMatrix()),He.setValue(L,"projectionMatrix",S.projectionMatrix),He.setValue(L,"viewMatrix",S.matrixWorldInverse);let Et=He.map.cameraPosition;Et!==void 0&&Et.setValue(L,Ti.setFromMatrixPosition(S.matrixWorld)),it.logarithmicDepthBuffer&&He.setValue(L,"logDepthBufFC",2/(Math.log(S.far+1)/Math.LN2)),(N.isMeshPhongMaterial||N.isMeshToonMaterial||N.isMeshLambertMaterial||N.isMeshBasicMaterial||N.isMeshStandardMaterial||N.isShaderMaterial)&&He.setValue(L,"isOrthographic",S.isOrthographicCamera===!0),J!==S&&(J=S,Bi=!0,tn=!0)}if(_e.needsLights&&(zt.state.sunShadowMap.length>0&&He.setValue(L,"sunShadowMap",zt.state.sunShadowMap,Ce),zt.state.directionalShadowMap.length>0&&He.setValue(L,"directionalShadowMap",zt.state.directionalShadowMap,Ce),zt.state.spotShadowMap.length>0&&He.setValue(L,"spotShadowMap",zt.state.spotShadowMap,Ce),zt.state.pointShadowMap.length>0&&He.setValue(L,"pointShadowMap",zt.state.pointShadowMap,Ce)),O.isSkinnedMesh){He.setOptional(L,O,"bindMatrix"),He.setOptional(L,O,"bindMatrixInverse");let ot=O.skeleton;ot&&(ot.boneTexture===null&&ot.computeBoneTexture(),He.setValue(L,"boneTexture",ot.boneTexture,Ce))}O.isBatchedMesh&&(He.setOptional(L,O,"batchingTexture"),He.setValue(L,"batchingTexture",O._matricesTexture,Ce),He.setOptional(L,O,"batchingIdTexture"),He.setValue(L,"batchingIdTexture",O._indirectTexture,Ce),He.setOptional(L,O,"batchingColorTexture"),O._colorsTexture!==null&&He.setValue(L,"batchingColorTexture",O._colorsTexture,Ce));let di=G.morphAttributes;if((di.position!==void 0||di.normal!==void 0||di.color!==void 0)&&Y.update(O,G,Lt),(Bi||_e.receiveShadow!==O.receiveShadow)&&(_e.receiveShadow=O.receiveShadow,He.setValue(L,"receiveShadow",O.receiveShadow)),(N.isMeshStandardMaterial||N.isMeshLambertMaterial||N.isMeshPhongMaterial)&&N.envMap===null&&w.environment!==null&&(Rt.envMapIntensity.value=w.environmentIntensity),Rt.dfgLUT!==void 0&&(Rt.dfgLUT.value=cd()),Bi){if(He.setValue(L,"toneMappingExposure",D.toneMappingExposure),_e.needsLights&&dd(Rt,tn),ce&&N.fog===!0&&ne.refreshFogUniforms(Rt,ce),ne.refreshMaterialUniforms(Rt,N,Te,Ze,b.state.transmissionRenderTarget[S.id]),_e.needsLights&&_e.numLightProbeGrids>0){let ot=M,Et=0;for(let Ri of b.state.lightProbeGridArray)Ri.texture!==null&&(ot.textures[Et]=Ri.texture,ot.min[Et]=Ri.boundingBox.min,ot.max[Et]=Ri.boundingBox.max,ot.resolution[Et]=Ri.resolution,Et++);for(let Ri in ot)ot[Ri].length=Et;Rt.probesSH.value=ot.textures,Rt.probesMin.value=ot.min,Rt.probesMax.value=ot.max,Rt.probesResolution.value=ot.resolution}Qi.upload(L,Qa(_e),Rt,Ce)}if(N.isShaderMaterial&&N.uniformsNeedUpdate===!0&&(Qi.upload(L,Qa(_e),Rt,Ce),N.uniformsNeedUpdate=!1),N.isSpriteMaterial&&He.setValue(L,"center",O.center),He.setValue(L,"modelViewMatrix",O.modelViewMatrix),He.setValue(L,"normalMatrix",O.normalMatrix),He.setValue(L,"modelMatrix",O.matrixWorld),N.uniformsGroups!==void 0){let ot=N.uniformsGroups;for(let Et=0,Ri=ot.length;Et<Ri;Et++){let tl=ot[Et];ve.update(tl,Lt),ve.bind(tl,Lt)}}return Lt}function dd(S,w){S.ambientLightColor.needsUpdate=w,S.lightProbe.needsUpdate=w,S.sunLights.needsUpdate=w,S.sunLightShadows.needsUpdate=w,S.directionalLights.needsUpdate=w,S.directionalLightShadows.needsUpdate=w,S.pointLights.needsUpdate=w,S.pointLightShadows.needsUpdate=w,S.spotLights.needsUpdate=w,S.spotLightShadows.needsUpdate=w,S.rectAreaLights.needsUpdate=w,S.hemisphereLights.needsUpdate=w}function pd(S){return S.isMeshLambertMaterial||S.isMeshToonMaterial||S.isMeshPhongMaterial||S.isMeshStandardMaterial||S.isShadowMaterial||S.isShaderMaterial&&S.lights===!0}this.getActiveCubeFace=function(){return K},this.getActiveMipmapLevel=function(){return H},this.getRenderTarget=function(){return te},this.setRenderTargetTextures=function(S,w,G){let N=be.get(S);N.__autoAllocateDepthBuffer=S.resolveDepthBuffer===!1,N.__autoAllocateDepthBuffer===!1&&(N.__useRenderToTexture=!1),be.get(S.texture).__webglTexture=w,be.get(S.depthTexture).__webglTexture=N.__autoAllocateDepthBuffer?void 0:G,N.__hasExternalTextures=!0},this.setRenderTargetFramebuffer=function(S,w){let G=be.get(S);G.__webglFramebuffer=w,G.__useDefaultFramebuffer=w===void 0},this.setRenderTarget=function(S,w=0,G=0){te=S,K=w,H=G;let N=null,O=!1,ce=!1;if(S){let ae=be.get(S);if(ae.__useDefaultFramebuffer!==void 0){fe.bindFramebuffer(L.FRAMEBUFFER,ae.__webglFramebuffer),Q.copy(S.viewport),Se.copy(S.scissor),Ne=S.scissorTest,fe.viewport(Q),fe.scissor(Se),fe.setScissorTest(Ne),k=-1;return}else if(ae.__webglFramebuffer===void 0)Ce.setupRenderTarget(S);else if(ae.__hasExternalTextures)Ce.rebindTextures(S,be.get(S.texture).__webglTexture,be.get(S.depthTexture).__webglTexture);else if(S.depthBuffer){let Le=S.depthTexture;if(ae.__boundDepthTexture!==Le){if(Le!==null&&be.has(Le)&&(S.width!==Le.image.width||S.height!==Le.image.height))throw new Error("THREE.WebGLRenderer: Attached DepthTexture is initialized to the incorrect size.");Ce.setupDepthRenderbuffer(S)}}let de=S.texture;(de.isData3DTexture||de.isDataArrayTexture||de.isCompressedArrayTexture)&&(ce=!0);let xe=be.get(S).__webglFramebuffer;S.isWebGLCubeRenderTarget?(Array.isArray(xe[w])?N=xe[w][G]:N=xe[w],O=!0):S.samples>0&&Ce.useMultisampledRTT(S)===!1?N=be.get(S).__webglMultisampledFramebuffer:Array.isArray(xe)?N=xe[G]:N=xe,Q.copy(S.viewport),Se.copy(S.scissor),Ne=S.scissorTest}else Q.copy(Ve).multiplyScalar(Te).floor(),Se.copy(mt).multiplyScalar(Te).floor(),Ne=Gt;if(G!==0&&(N=$),fe.bindFramebuffer(L.FRAMEBUFFER,N)&&fe.drawBuffers(S,N),fe.viewport(Q),fe.scissor(Se),fe.setScissorTest(Ne),O){let ae=be.get(S.texture);L.framebufferTexture2D(L.FRAMEBUFFER,L.COLOR_ATTACHMENT0,L.TEXTURE_CUBE_MAP_POSITIVE_X+w,ae.__webglTexture,G)}else if(ce){let ae=w;for(let de=0;de<S.textures.length;de++){let xe=be.get(S.textures[de]);L.framebufferTextureLayer(L.FRAMEBUFFER,L.COLOR_ATTACHMENT0+de,xe.__webglTexture,G,ae)}}else if(S!==null&&G!==0){let ae=be.get(S.texture);L.framebufferTexture2D(L.FRAMEBUFFER,L.COLOR_ATTACHMENT0,L.TEXTURE_2D,ae.__webglTexture,G)}k=-1};function el(S){let w=be.get(S);return(w.__readFormat!==S.format||w.__readType!==S.type)&&(w.__readFormat=S.format,w.__readType=S.type,w.__formatReadable=it.textureFormatReadable(S.format),w.__typeReadable=it.textureTypeReadable(S.type)),w}this.readRenderTargetPixels=function(S,w,G,N,O,ce,me,ae=0){if(!(S&&S.isWebGLRenderTarget)){Oe("WebGLRenderer.readRenderTargetPixels: renderTarget is not THREE.WebGLRenderTarget.");return}let de=be.get(S).__webglFramebuffer;if(S.isWebGLCubeRenderTarget&&me!==void 0&&(de=de[me],Array.isArray(de)&&(de=de[0])),de){fe.bindFramebuffer(L.FRAMEBUFFER,de);try{let xe=S.textures[ae],Le=xe.format,Be=xe.type;S.textures.length>1&&L.readBuffer(L.COLOR_ATTACHMENT0+ae);let ge=el(xe);if(ge.__formatReadable===!1){Oe("WebGLRenderer.readRenderTargetPixels: renderTarget is not in RGBA or implementation defined format.");return}if(ge.__typeReadable===!1){Oe("WebGLRenderer.readRenderTargetPixels: renderTarget is not in UnsignedByteType or implementation defined type.");return}w>=0&&w<=S.width-N&&G>=0&&G<=S.height-O&&L.readPixels(w,G,N,O,ie.convert(Le),ie.convert(Be),ce)}finally{let xe=te!==null?be.get(te).__webglFramebuffer:null;fe.bindFramebuffer(L.FRAMEBUFFER,xe)}}},this.readRenderTargetPixelsAsync=async function(S,w,G,N,O,ce,me,ae=0){if(!(S&&S.isWebGLRenderTarget))throw new Error("THREE.WebGLRenderer.readRenderTargetPixels: renderTarget is not THREE.WebGLRenderTarget.");let de=be.get(S).__webglFramebuffer;if(S.isWebGLCubeRenderTarget&&me!==void 0&&(de=de[me],Array.isArray(de)&&(de=de[0])),de)if(w>=0&&w<=S.width-N&&G>=0&&G<=S.height-O){fe.bindFramebuffer(L.FRAMEBUFFER,de);let xe=S.textures[ae],Le=xe.format,Be=xe.type;S.textures.length>1&&L.readBuffer(L.COLOR_ATTACHMENT0+ae);let ge=el(xe);if(ge.__formatReadable===!1)throw new Error("THREE.WebGLRenderer.readRenderTargetPixelsAsync: renderTarget is not in RGBA or implementation defined format.");if(ge.__typeReadable===!1)throw new Error("THREE.WebGLRenderer.readRenderTargetPixelsAsync: renderTarget is not in UnsignedByteType or implementation defined type.");let Ge=L.createBuffer();L.bindBuffer(L.PIXEL_PACK_BUFFER,Ge),L.bufferData(L.PIXEL_PACK_BUFFER,ce.byteLength,L.STREAM_READ),L.readPixels(w,G,N,O,ie.convert(Le),ie.convert(Be),0),L.bindBuffer(L.PIXEL_PACK_BUFFER,null);let ct=te!==null?be.get(te).__webglFramebuffer:null;fe.bindFramebuffer(L.FRAMEBUFFER,ct);let je=L.fenceSync(L.SYNC_GPU_COMMANDS_COMPLETE,0);return L.flush(),await Gl(L,je,4),L.bindBuffer(L.PIXEL_PACK_BUFFER,Ge),L.getBufferSubData(L.PIXEL_PACK_BUFFER,0,ce),L.bindBuffer(L.PIXEL_PACK_BUFFER,null),L.deleteBuffer(Ge),L.deleteSync(je),ce}else throw new Error("THREE.WebGLRenderer.readRenderTargetPixelsAsync: requested read bounds are out of range.")},this.copyFramebufferToTexture=function(S,w=null,G=0){let N=Math.pow(2,-G),O=Math.floor(S.image.width*N),ce=Math.floor(S.image.height*N),me=w!==null?w.x:0,ae=w!==null?w.y:0;Ce.setTexture2D(S,0),L.copyTexSubImage2D(L.TEXTURE_2D,G,0,0,me,ae,O,ce),fe.unbindTexture()},this.copyTextureToTexture=function(S,w,G=null,N=null,O=0,ce=0){let me,ae,de,xe,Le,Be,ge,Ge,ct,je=S.isCompressedTexture?S.mipmaps[ce]:S.image;if(G!==null)me=G.max.x-G.min.x,ae=G.max.y-G.min.y,de=G.isBox3?G.max.z-G.min.z:1,xe=G.min.x,Le=G.min.y,Be=G.isBox3?G.min.z:0;else{let He=Math.pow(2,-O);me=Math.floor(je.width*He),ae=Math.floor(je.height*He),S.isDataArrayTexture?de=je.depth:S.isData3DTexture?de=Math.floor(je.depth*He):de=1,xe=0,Le=0,Be=0}N!==null?(ge=N.x,Ge=N.y,ct=N.z):(ge=0,Ge=0,ct=0);let Je=ie.convert(w.format),Pt=ie.convert(w.type),_e;w.isData3DTexture?(Ce.setTexture3D(w,0),_e=L.TEXTURE_3D):w.isDataArrayTexture||w.isCompressedArrayTexture?(Ce.setTexture2DArray(w,0),_e=L.TEXTURE_2D_ARRAY):(Ce.setTexture2D(w,0),_e=L.TEXTURE_2D),fe.activeTexture(L.TEXTURE0),fe.pixelStorei(L.UNPACK_FLIP_Y_WEBGL,w.flipY),fe.pixelStorei(L.UNPACK_PREMULTIPLY_ALPHA_WEBGL,w.premultiplyAlpha),fe.pixelStorei(L.UNPACK_ALIGNMENT,w.unpackAlignment);let zt=fe.getParameter(L.UNPACK_ROW_LENGTH),ke=fe.getParameter(L.UNPACK_IMAGE_HEIGHT),en=fe.getParameter(L.UNPACK_SKIP_PIXELS),Lt=fe.getParameter(L.UNPACK_SKIP_ROWS),_o=fe.getParameter(L.UNPACK_SKIP_IMAGES);fe.pixelStorei(L.UNPACK_ROW_LENGTH,je.width),fe.pixelStorei(L.UNPACK_IMAGE_HEIGHT,je.height),fe.pixelStorei(L.UNPACK_SKIP_PIXELS,xe),fe.pixelStorei(L.UNPACK_SKIP_ROWS,Le),fe.pixelStorei(L.UNPACK_SKIP_IMAGES,Be);let Bi=S.isDataArrayTexture||S.isData3DTexture,tn=w.isDataArrayTexture||w.isData3DTexture;if(S.isDepthTexture){let He=be.get(S),Rt=be.get(w),di=be.get(He.__renderTarget),ot=be.get(Rt.__renderTarget);fe.bindFramebuffer(L.READ_FRAMEBUFFER,di.__webglFramebuffer),fe.bindFramebuffer(L.DRAW_FRAMEBUFFER,ot.__webglFramebuffer);for(let Et=0;Et<de;Et++)Bi&&(L.framebufferTextureLayer(L.READ_FRAMEBUFFER,L.COLOR_ATTACHMENT0,be.get(S).__webglTexture,O,Be+Et),L.framebufferTextureLayer(L.DRAW_FRAMEBUFFER,L.COLOR_ATTACHMENT0,be.get(w).__webglTexture,ce,ct+Et)),L.blitFramebuffer(xe,Le,xe+me,Le+ae,ge,Ge,ge+me,Ge+ae,L.DEPTH_BUFFER_BIT,L.NEAREST);fe.bindFramebuffer(L.READ_FRAMEBUFFER,null),fe.bindFramebuffer(L.DRAW_FRAMEBUFFER,null)}else if(O!==0||S.isRenderTargetTexture||be.has(S)){let He=be.get(S),Rt=be.get(w);fe.bindFramebuffer(L.READ_FRAMEBUFFER,P),fe.bindFramebuffer(L.DRAW_FRAMEBUFFER,W);for(let di=0;di<de;di++)Bi?L.framebufferTextureLayer(L.READ_FRAMEBUFFER,L.COLOR_ATTACHMENT0,He.__webglTexture,O,Be+di):L.framebufferTexture2D(L.READ_FRAMEBUFFER,L.COLOR_ATTACHMENT0,L.TEXTURE_2D,He.__webglTexture,O),tn?L.framebufferTextureLayer(L.DRAW_FRAMEBUFFER,L.COLOR_ATTACHMENT0,Rt.__webglTexture,ce,ct+di):L.framebufferTexture2D(L.DRAW_FRAMEBUFFER,L.COLOR_ATTACHMENT0,L.TEXTURE_2D,Rt.__webglTexture,ce),O!==0?L.blitFramebuffer(xe,Le,xe+me,Le+ae,ge,Ge,ge+me,Ge+ae,L.COLOR_BUFFER_BIT,L.NEAREST):tn?L.copyTexSubImage3D(_e,ce,ge,Ge,ct+di,xe,Le,me,ae):L.copyTexSubImage2D(_e,ce,ge,Ge,xe,Le,me,ae);fe.bindFramebuffer(L.READ_FRAMEBUFFER,null),fe.bindFramebuffer(L.DRAW_FRAMEBUFFER,null)}else tn?S.isDataTexture||S.isData3DTexture?L.texSubImage3D(_e,ce,ge,Ge,ct,me,ae,de,Je,Pt,je.data):w.isCompressedArrayTexture?L.compressedTexSubImage3D(_e,ce,ge,Ge,ct,me,ae,de,Je,je.data):L.texSubImage3D(_e,ce,ge,Ge,ct,me,ae,de,Je,Pt,je):S.isDataTexture?L.texSubImage2D(L.TEXTURE_2D,ce,ge,Ge,me,ae,Je,Pt,je.data):S.isCompressedTexture?L.compressedTexSubImage2D(L.TEXTURE_2D,ce,ge,Ge,je.width,je.height,Je,je.data):L.texSubImage2D(L.TEXTURE_2D,ce,ge,Ge,me,ae,Je,Pt,je);fe.pixelStorei(L.UNPACK_ROW_LENGTH,zt),fe.pixelStorei(L.UNPACK_IMAGE_HEIGHT,ke),fe.pixelStorei(L.UNPACK_SKIP_PIXELS,en),fe.pixelStorei(L.UNPACK_SKIP_ROWS,Lt),fe.pixelStorei(L.UNPACK_SKIP_IMAGES,_o),ce===0&&w.generateMipmaps===!0&&w.mipmapsAutoUpdate===!0&&L.generateMipmap(_e),fe.unbindTexture()},this.initRenderTarget=function(S){be.get(S).__webglFramebuffer===void 0&&Ce.setupRenderTarget(S)},this.initTexture=function(S){S.isCubeTexture?Ce.setTextureCube(S,0):S.isData3DTexture?Ce.setTexture3D(S,0):S.isDataArrayTexture||S.isCompressedArrayTexture?Ce.setTexture2DArray(S,0):Ce.setTexture2D(S,0),fe.unbindTexture()},this.resetState=function(){K=0,H=0,te=null,fe.reset(),re.reset()},typeof __THREE_DEVTOOLS__<"u"&&__THREE_DEVTOOLS__.dispatchEvent(new CustomEvent("observe",{detail:this}))}get coordinateSystem(){return wt}get outputColorSpace(){return this._outputColorSpace}set outputColorSpace(e){this._outputColorSpace=e;let t=this.getContext();t.drawingBufferColorSpace=Re._getDrawingBufferColorSpace(e),t.unpackColorSpace=Re._getUnpackColorSpace()}};export{xr as ACESFilmicToneMapping,at as BackSide,Jt as Box3,$t as BufferAttribute,nt as BufferGeometry,wa as CircleGeometry,Me as Color,Re as ColorManagement,Hs as Controls,Ki as DataTexture,Fs as DirectionalLight,Wt as DoubleSide,xd as DynamicDrawUsage,yt as EventDispatcher,ut as FloatType,Zo as Fog,ii as Frustum,qo as Group,Ls as HemisphereLight,mn as InstancedBufferAttribute,Bs as InstancedBufferGeometry,fs as InstancedMesh,$n as Line,Jn as LineBasicMaterial,_s as LineSegments,ho as Loader,Os as LoaderUtils,md as MOUSE,dt as Material,Vl as MathUtils,we as Matrix4,Ot as Mesh,Zn as MeshBasicMaterial,ir as MeshDepthMaterial,nr as MeshDistanceMaterial,Ps as MeshLambertMaterial,Cs as MeshStandardMaterial,et as NearestFilter,Xt as NoToneMapping,Xe as Object3D,$i as OrthographicCamera,nn as PCFShadowMap,Ei as PerspectiveCamera,Vt as Plane,vs as Points,Zt as Quaternion,_d as RGBADepthPacking,Yt as RGBAFormat,yi as Ray,Ko as Scene,ni as ShaderMaterial,As as ShapeUtils,Ct as Sphere,Da as SphereGeometry,zs as Spherical,gd as TOUCH,lt as Texture,ye as Vector2,I as Vector3,We as Vector4,Nt as WebGLRenderTarget,Ks as WebGLRenderer};
