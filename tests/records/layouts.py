"""Files of temperatures in the layouts of weather services and loggers, with their right reading.

Every value is invented. The same weather is written in each layout: two days of hours, or two weeks
of days, rounded as the service rounds; `LAYOUTS` names the function that writes it.
"""

# ruff: noqa: E501
# fmt: off

from __future__ import annotations

import gzip
import io
import math
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from typing import Any

BEGIN = datetime(2031, 6, 1)
HOURS = [BEGIN + timedelta(hours=k) for k in range(48)]
T = [round(15.3 - 6.8 * math.cos((k - 3) / 12 * math.pi) + 0.3 * (k % 5), 1) for k in range(48)]
DEW = [round(value - 6, 1) for value in T]
DAYS = [BEGIN + timedelta(days=k) for k in range(16)]
LOW = [round(8.5 + 3 * math.sin(k), 1) for k in range(16)]
HIGH = [round(21.5 + 4 * math.sin(k + 0.5), 1) for k in range(16)]
RH = [50 + k % 30 for k in range(48)]


@dataclass(frozen=True)
class File:
    """A file, and how many readings it has, in degrees Celsius.

    `needs`: the option by which it is refused at first, and `given`: options that read it.
    """

    content: bytes
    readings: int = 48
    first: datetime = HOURS[0]
    last: datetime = HOURS[-1]
    low: float = min(T)
    high: float = max(T)
    missing: int = 0
    needs: str = ""
    given: dict[str, Any] = field(default_factory=dict)
    ending: str = ".csv"
    near: float = 0.051


def hourly(head: str, row: Callable[[int, datetime], str], end: str = "", **about: Any) -> File:
    """Return a file with a row for each hour."""
    return written(head, [row(k, hour) for k, hour in enumerate(HOURS)], end, **about)


def daily(head: str, row: Callable[[int, datetime], str], end: str = "", **about: Any) -> File:
    """Return a file with a row for each day."""
    two = {"readings": 32, "first": DAYS[0] + timedelta(hours=5), "low": min(LOW),
           "last": DAYS[-1] + timedelta(hours=15), "high": max(HIGH)}
    return written(head, [row(k, day) for k, day in enumerate(DAYS)], end, **(two | about))


def one_a_day(values: Sequence[float] = HIGH, **about: Any) -> dict[str, Any]:
    """Return what is right for a single reading a day."""
    return {"readings": 16, "first": DAYS[0], "last": DAYS[-1], "low": min(values),
            "high": max(values)} | about


def written(
    head: str, rows: Sequence[str], end: str = "", *, encoding: str = "utf-8", newline: str = "\n",
    **about: Any,
) -> File:
    lines = [*([head] if head else []), *rows, *([end] if end else [])]
    text = newline.join("\n".join(lines).split("\n")) + newline
    return File(text.encode(encoding), **about)


def comma(value: float) -> str:
    return f"{value}".replace(".", ",")


def tenths(value: float) -> int:
    return round(10 * value)


def fahrenheit(value: float) -> float:
    return round(value * 1.8 + 32, 1)


LAYOUTS: dict[str, Callable[[], File]] = {}
CODED: dict[str, Callable[[], File]] = {}


def layout(make: Callable[[], File]) -> Callable[[], File]:
    LAYOUTS[make.__name__] = make
    return make


def add(name: str, make: Callable[[], File]) -> None:
    LAYOUTS[name] = make


def hours(
    name: str, head: str, row: Callable[[int, datetime], str], end: str = "", **about: Any
) -> None:
    add(name, lambda: hourly(head, row, end, **about))


def days(
    name: str, head: str, row: Callable[[int, datetime], str], end: str = "", **about: Any
) -> None:
    add(name, lambda: daily(head, row, end, **about))


def months(
    name: str, head: str, row: Callable[[int, datetime], str], low: float, high: float, **about: Any
) -> None:
    begins = [datetime(2029 + k // 12, k % 12 + 1, 1) for k in range(36)]
    add(name, lambda: written(head, [row(k, m) for k, m in enumerate(begins)], readings=36,
                              first=begins[0], last=begins[-1], low=low, high=high, **about))


# --- services of Europe ---------------------------------------------------------------------------

hours("dwd_hourly", "STATIONS_ID;MESS_DATUM;QN_9;TT_TU;RF_TU;eor",
      lambda k, h: f"        433;{h:%Y%m%d%H};    3;  {T[k]:5};  {RH[k]}.0;eor")
hours("dwd_ten_minutes", "STATIONS_ID;MESS_DATUM;  QN;PP_10;TT_10;TM5_10;RF_10;TD_10;eor",
      lambda k, h: f" 433;{h:%Y%m%d%H%M};    2;  1003.1;  {T[k]};  {T[k] + 1:.1f};  {RH[k]}.0;  {DEW[k]};eor")
days("dwd_daily", "STATIONS_ID;MESS_DATUM;QN_3;  FX;  FM;QN_4; RSK;RSKF; SDK;SHK_TAG;  NM; VPM;  PM; TMK; UPM; TXK; TNK; TGK;eor",
      lambda k, d: f" 433;{d:%Y%m%d};10; 12.1; 4.2; 3; 0.0;  0; 3.2;  0; 5.1; 9.1; 1003.1; {(LOW[k] + HIGH[k]) / 2:.1f}; 71.0; {HIGH[k]}; {LOW[k]}; {LOW[k] - 2:.1f};eor")
hours("smhi", "Stationsnamn;Stationsnummer;Stationsnät;Mäthöjd (meter över marken)\nX;97400;SMHIs stationsnät;2.0\n\n" "Parameternamn;Beskrivning;Enhet\nLufttemperatur;momentanvärde, 1 gång/tim;celsius\n\n" "Datum;Tid (UTC);Lufttemperatur;Kvalitet;;Tidsutsnitt:",
      lambda k, h: f"{h:%Y-%m-%d};{h:%H:%M:%S};{T[k]};G" + (";;Kvalitetskontrollerade historiska data" if k < 2 else ";;"))
KNMI = """# DEZE GEGEVENS MOGEN VRIJ WORDEN GEBRUIKT
# STN         LON(east)   LAT(north)  ALT(m)      NAME
# 260         5.180       52.100      1.90        De Bilt
# T         : Temperature (in 0.1 degrees Celsius) at 1.50 m at the time of observation
# TD        : Dew point temperature (in 0.1 degrees Celsius) at 1.50 m
# U         : Relative atmospheric humidity (in percents) at 1.50 m
# STN,YYYYMMDD,   HH,    T,   TD,    U"""
hours("knmi_without_preamble", "STN,YYYYMMDD,HH,T,TD,U",
      lambda k, h: f"260,{h:%Y%m%d},{h.hour},{tenths(T[k])},{tenths(DEW[k])},{RH[k]}")
days("knmi_daily", "BRON: KNMI\nTG : Etmaalgemiddelde temperatuur (in 0.1 graden Celsius)\nTN : Minimum temperatuur (in 0.1 graden Celsius)\n" "TX : Maximum temperatuur (in 0.1 graden Celsius)\nT10N : Minimum temperatuur op 10 cm hoogte (in 0.1 graden Celsius)\n\n# STN,YYYYMMDD,   TG,   TN,  TNH,   TX,  TXH, T10N",
      lambda k, d: f"  260,{d:%Y%m%d},{tenths((LOW[k] + HIGH[k]) / 2):5},{tenths(LOW[k]):5},    4,{tenths(HIGH[k]):5},   14,{tenths(LOW[k]) - 20:5}")
hours("meteo_france_synop", "numer_sta;date;pmer;t;td;u;vv",
      lambda k, h: f"07005;{h:%Y%m%d%H%M%S};101320;{T[k] + 273.15:.2f};{DEW[k] + 273.15:.2f};{RH[k]};mq", needs="unit", given={"unit": "K"})
days("meteo_france_daily", "NUM_POSTE;NOM_USUEL;LAT;LON;ALTI;AAAAMMJJ;RR;QRR;TN;QTN;HTN;QHTN;TX;QTX;HTX;QHTX;TM;QTM;TNTXM;QTNTXM;TAMPLI;QTAMPLI;TNSOL;QTNSOL;TN50;QTN50",
      lambda k, d: f"01014002;ARBENT;46.27;5.66;534;{d:%Y%m%d};0.0;1;{LOW[k]};1;0512;9;{HIGH[k]};1;1420;9;{(LOW[k] + HIGH[k]) / 2:.1f};1;" f"{(LOW[k] + HIGH[k]) / 2:.1f};1;{HIGH[k] - LOW[k]:.1f};1;{LOW[k] - 2:.1f};1;;")
hours("meteo_france_hourly", "NUM_POSTE;NOM_USUEL;AAAAMMJJHH;RR1;QRR1;FF;QFF;T;QT;TD;QTD;TN;QTN;HTN;TX;QTX;T10;T50;TSV;U",
      lambda k, h: f"01014002;ARBENT;{h:%Y%m%d%H};0.0;1;2.1;1;{T[k]};1;{DEW[k]};1;{T[k] - 0.4:.1f};1;{h.hour:02}20;{T[k] + 0.4:.1f};1;15.1;14.2;9.1;{RH[k]}")
hours("meteoswiss", "station_abbr;reference_timestamp;tre200s0;tde200s0;ure200s0;tre005s0",
      lambda k, h: f"BER;{h:%d.%m.%Y %H:%M};{T[k]};{DEW[k]};{RH[k]}.0;{T[k] + 2:.1f}")
days("meteoswiss_daily", "station/location;date;gre000d0;hto000d0;tre200d0;tre200dn;tre200dx;ure200d0",
      lambda k, d: f"BER;{d:%Y%m%d};210;0;{(LOW[k] + HIGH[k]) / 2:.1f};{LOW[k]};{HIGH[k]};71.2")
hours("met_norway", "Navn;Stasjon;Tid(norsk normaltid);Lufttemperatur;Relativ luftfuktighet",
      lambda k, h: f"Oslo - Blindern;SN18700;{h:%d.%m.%Y %H:%M};{comma(T[k])};{RH[k]}", "Data er gyldig per 01.07.2031 (CC BY 4.0), Meteorologisk institutt (MET);;;;")
days("met_norway_daily", "Navn;Stasjon;Tid(norsk normaltid);Maksimumstemperatur (døgn);Minimumstemperatur (døgn);Middeltemperatur (døgn)",
      lambda k, d: f"Oslo;SN18700;{d:%d.%m.%Y};{comma(HIGH[k])};{comma(LOW[k])};{comma(round((LOW[k] + HIGH[k]) / 2, 1))}")
hours("fmi", "Vuosi,Kk,Pv,Klo,Aikavyöhyke,Ilman lämpötila (degC),Kastepistelämpötila (degC)",
      lambda k, h: f"{h.year},{h.month},{h.day},{h:%H:%M},UTC,{T[k]},{DEW[k]}")
hours("fmi_english", "Year,m,d,Time,Time zone,Air temperature (degC),Dew-point temperature (degC)",
      lambda k, h: f"{h.year},{h.month},{h.day},{h:%H:%M},UTC,{T[k]},{DEW[k]}")
hours("dmi", "observed,stationId,temp_dry,temp_dew,humidity",
      lambda k, h: f"{h:%Y-%m-%dT%H:%M:%SZ},06180,{T[k]},{DEW[k]},{RH[k]}")
hours("dmi_archive", "DateTime;Middeltemperatur;Luftfugtighed",
      lambda k, h: f"{h:%Y-%m-%d %H:%M:%S};{T[k]};{RH[k]}")
days("chmi", "Rok;Měsíc;Den;Průměrná teplota;Maximální teplota;Minimální teplota",
      lambda k, d: f"{d.year};{d.month};{d.day};{comma(round((LOW[k] + HIGH[k]) / 2, 1))};{comma(HIGH[k])};{comma(LOW[k])}", encoding="cp1250")
days("aemet", '"fecha","indicativo","nombre","provincia","altitud","tmed","prec","tmin","horatmin","tmax","horatmax","dir"',
      lambda k, d: f'"{d:%Y-%m-%d}","3195","MADRID, RETIRO","MADRID","667","{comma(round((LOW[k] + HIGH[k]) / 2, 1))}","0,0","{comma(LOW[k])}","05:10","{comma(HIGH[k])}","15:00","24"')
hours("aemet_observation", "fint;idema;ubi;prec;ta;tamin;tamax;hr;tpr",
      lambda k, h: f"{h:%Y-%m-%dT%H:%M:%S};3195;MADRID;0.0;{T[k]};{T[k] - 0.3:.1f};{T[k] + 0.3:.1f};{RH[k]};{DEW[k]}")
hours("ipma", "idEstacao,time,temperatura,humidade,intensidadeVentoKM,precAcumulada",
      lambda k, h: f"1200545,{h:%Y-%m-%dT%H:%M},{T[k]},{RH[k]}.0,9.4,0.0")
hours("arpa", "Data-Ora,Temperatura media (°C),Umidità relativa (%)",
      lambda k, h: f"{h:%d/%m/%Y %H:%M},{T[k]},{RH[k]}")
hours("met_ie", "Station Name: X\nStation Height: 71 M \n\ndate:  -  Date and Time (utc)\ntemp:  -  Air Temperature (C)\nwetb:  -  Wet Bulb Temperature (C)\nind:   -  Indicator\n\n" "date,ind,rain,ind,temp,ind,wetb,dewpt,vappr,rhum,msl",
      lambda k, h: f"{h:%d-%b-%Y %H:%M},0,0.0,0,{T[k]},0,{T[k] - 2:.1f},{DEW[k]},9.1,{RH[k]},1012.1".lower())
days("met_ie_daily", "date,ind,maxtp,ind,mintp,igmin,gmin,ind,rain",
      lambda k, d: f"{d:%d-%b-%Y},0,{HIGH[k]},0,{LOW[k]},0,{LOW[k] - 2:.1f},0,0.1".lower())
hours("badc_csv", "Conventions,G,BADC-CSV,1\ntitle,G,uk-hourly-weather-obs\nmissing_value,G,NA\nlong_name,air_temperature,Dry bulb temperature,degC\n" "long_name,dewpoint,Dew point,degC\ntype,air_temperature,float\ndata\nob_time,id,id_type,met_domain_name,src_id,wind_speed,air_temperature,dewpoint,wetb_temp,air_temperature_q,dewpoint_q,wetb_temp_q",
      lambda k, h: f"{h:%Y-%m-%d %H:%M:%S},1467,DCNN,SYNOP,19144,7,{T[k]},{DEW[k]},{T[k] - 2:.1f},6,6,6", "end data")
days("badc_daily", "data\nob_end_time,id_type,id,ob_hour_count,max_air_temp,min_air_temp,min_grss_temp,max_air_temp_q,min_air_temp_q,max_air_temp_j",
      lambda k, d: f"{d:%Y-%m-%d} 09:00:00,DCNN,1467,24,{HIGH[k]},{LOW[k]},{LOW[k] - 2:.1f},6,6,NA", "end data", first=DAYS[0] + timedelta(hours=14), last=DAYS[-1] + timedelta(hours=24))
months("met_office_monthly", "Oxford\nLocation 450900E 207200N, 63 metres amsl\n   yyyy  mm   tmax    tmin      af    rain     sun\n              degC    degC    days      mm   hours",
       lambda k, m: f"   {m.year}  {m.month:2}   {12 + k % 7}.5    {4 + k % 7}.1       4    {40 + k}.1    {60 + k}.2", 12.5, 18.5, needs="temperature_column", given={"temperature_column": "tmax"})
hours("euskalmet", "Fecha;Hora;Temp. Aire (ºC);Humedad (%)",
      lambda k, h: f"{h:%d/%m/%Y};{h:%H:%M};{comma(T[k])};{RH[k]}", encoding="latin-1")

# --- other continents -----------------------------------------------------------------------------

hours("isd_global_hourly", '"STATION","DATE","SOURCE","LATITUDE","REPORT_TYPE","WND","TMP","DEW","SLP"',
      lambda k, h: f'"72505394728","{h:%Y-%m-%dT%H:%M:%S}","7","40.77","FM-15","340,5,N,0021,5","{tenths(T[k]):+05},5","{tenths(DEW[k]):+05},5","10131,5"')
hours("lcd_v1", '"STATION","DATE","REPORT_TYPE","HourlyDewPointTemperature","HourlyDryBulbTemperature","HourlyRelativeHumidity","HourlyWetBulbTemperature"',
      lambda k, h: f'"72505394728","{h:%Y-%m-%dT%H:%M:%S}","FM-15","{round(fahrenheit(DEW[k]))}","{round(fahrenheit(T[k]))}","{RH[k]}","{round(fahrenheit(T[k])) - 4}"', needs="unit", given={"unit": "F"}, near=0.3)
days("ghcn_access", '"STATION","DATE","LATITUDE","LONGITUDE","ELEVATION","NAME","PRCP","PRCP_ATTRIBUTES","TMAX","TMAX_ATTRIBUTES","TMIN","TMIN_ATTRIBUTES"',
      lambda k, d: f'"USW00094728","{d:%Y-%m-%d}","40.77","-73.96","42.7","NY CITY, NY US","    0",",,W,2400","{tenths(HIGH[k]):5}",",,W","{tenths(LOW[k]):5}",",,W"', needs="unit", given={"scale": "0.1"})
hours("iem_asos", "#DEBUG: Format Typ    -> onlycomma\n#DEBUG: Time Period   -> 2031-06-01\nstation,valid,tmpf,dwpf,relh,feel",
      lambda k, h: f"AMW,{h:%Y-%m-%d %H:%M},{fahrenheit(T[k]):.2f},{fahrenheit(DEW[k]):.2f},{RH[k]}.1,{fahrenheit(T[k]) + 3:.2f}")
hours("iem_celsius_tab", "station\tvalid\ttmpc\tdwpc",
      lambda k, h: f"AMW\t{h:%Y-%m-%d %H:%M}\t{T[k]:.2f}\t{DEW[k]:.2f}")
hours("meteostat_hourly", "date,hour,temp,dwpt,rhum,prcp,snow,wdir,wspd,wpgt,pres,tsun,coco",
      lambda k, h: f"{h:%Y-%m-%d},{h.hour},{T[k]},{DEW[k]},{RH[k]},0.0,,220,9.4,,1013.1,,")
hours("meteostat_bulk_without_names", "",
      lambda k, h: f"{h:%Y-%m-%d},{h.hour},{T[k]},{DEW[k]},{RH[k]},0.0,,220,9.4,,1013.1,,", needs="temperature_column", given={"time_column": ["1", "2"], "temperature_column": "3"})
hours("canada_hourly", '"Longitude (x)","Latitude (y)","Station Name","Climate ID","Date/Time (LST)","Year","Month","Day","Time (LST)","Flag","Temp (°C)","Temp Flag","Dew Point Temp (°C)","Dew Point Temp Flag","Rel Hum (%)","Wind Chill","Hmdx","Weather"',
      lambda k, h: f'"-79.4","43.67","TORONTO","6158355","{h:%Y-%m-%d %H:%M}","{h.year}","{h:%m}","{h:%d}","{h:%H:%M}","","{T[k]}","","{DEW[k]}","","{RH[k]}","","",""', encoding="utf-8-sig")
days("bom_maximum", '"Product code","Bureau of Meteorology station number","Year","Month","Day","Maximum temperature (Degree C)","Days of accumulation of maximum temperature","Quality"',
      lambda k, d: f"IDCJAC0010,066062,{d.year},{d:%m},{d:%d},{HIGH[k]},1,Y", **one_a_day())
days("bom_recent", ',"Date","Minimum temperature (°C)","Maximum temperature (°C)","Rainfall (mm)","9am Temperature (°C)","3pm Temperature (°C)","9am relative humidity (%)"',
      lambda k, d: f",{d:%Y-%m-%d},{LOW[k]},{HIGH[k]},0,{LOW[k] + 5:.1f},{HIGH[k] - 1:.1f},61")
hours("jma", "ダウンロードした時刻：2031/07/01 10:00:00\n\n,東京,東京,東京,東京,東京\n年月日時,気温(℃),気温(℃),気温(℃),露点温度(℃),露点温度(℃)\n,,品質情報,均質番号,,品質情報",
      lambda k, h: f"{h.year}/{h.month}/{h.day} {h.hour}:00:00,{T[k]},8,1,{DEW[k]},8", encoding="cp932", newline="\r\n")
days("jma_daily", "年月日,最高気温(℃),最高気温(℃),最低気温(℃),最低気温(℃)\n,,品質情報,,品質情報",
      lambda k, d: f"{d.year}/{d.month}/{d.day},{HIGH[k]},8,{LOW[k]},8", encoding="cp932")
hours("kma", "지점,지점명,일시,기온(°C),습도(%)",
      lambda k, h: f"108,서울,{h:%Y-%m-%d %H:%M},{T[k]},{RH[k]}", needs="", given={})
hours("inmet", "REGIAO:;SE\nUF:;SP\nESTACAO:;SAO PAULO\nLATITUDE:;-23,5\nDATA DE FUNDACAO:;25/07/06\n" "Data;Hora UTC;PRECIPITAÇÃO TOTAL, HORÁRIO (mm);TEMPERATURA DO AR - BULBO SECO, HORARIA (°C);TEMPERATURA DO PONTO DE ORVALHO (°C);TEMPERATURA MÁXIMA NA HORA ANT. (AUT) (°C);TEMPERATURA MÍNIMA NA HORA ANT. (AUT) (°C);UMIDADE RELATIVA DO AR, HORARIA (%);",
      lambda k, h: f"{h:%Y/%m/%d};{h:%H%M} UTC;0;{comma(T[k])};{comma(DEW[k])};{comma(round(T[k] + 1, 1))};{comma(round(T[k] - 1, 1))};{RH[k]};", encoding="latin-1")
hours("cimis", "Stn Id,Stn Name,CIMIS Region,Date,Hour (PST),Jul,ETo (in),qc,Air Temp (F),qc,Rel Hum (%),qc,Dew Point (F),qc,Soil Temp (F),qc",
      lambda k, h: f"6,Davis,Sacramento Valley,{(h - timedelta(hours=1)).month}/{(h - timedelta(hours=1)).day}/{(h - timedelta(hours=1)).year},{(h.hour or 24) * 100:04},{151},0.01, ,{fahrenheit(T[k])}, ,{RH[k]}, ,{fahrenheit(DEW[k])}, ,66.1, ")
hours("agrimet", "DateTime,boii_ob,boii_tu",
      lambda k, h: f"{h:%Y-%m-%d %H:%M},{fahrenheit(T[k])},{RH[k]}", needs="temperature_column", given={"temperature_column": "boii_ob", "unit": "F"})
hours("ncei_semicolon_kelvin", "time;air_temperature [K];dew_point_temperature [K]",
      lambda k, h: f"{h:%Y-%m-%dT%H:%M:%SZ};{T[k] + 273.15:.2f};{DEW[k] + 273.15:.2f}")
hours("usda_scan", "# Reporting Frequency: Hourly\n#\nDate,Fort Assiniboine (581) Air Temperature Observed (degF),Fort Assiniboine (581) Relative Humidity (pct)",
      lambda k, h: f"{h:%Y-%m-%d %H:%M},{fahrenheit(T[k])},{RH[k]}")
hours("uscrn", "",
      lambda k, h: f"94728 {h:%Y%m%d %H%M} {h:%Y%m%d %H%M}  3 -96.6 40.7 {T[k]:7.1f} {T[k]:7.1f} {T[k] + 0.3:7.1f} {T[k] - 0.3:7.1f} 0.0", needs="temperature_column", given={"time_column": ["2", "3"], "temperature_column": "9"})
days("saws", "StasName,DateT,MaxTemp,MinTemp,Rain",
      lambda k, d: f"PRETORIA,{d:%Y/%m/%d},{HIGH[k]},{LOW[k]},0.0")
days("imd", "INDEX,YEAR,MN,DT,MAX,MIN,RF",
      lambda k, d: f"42182,{d.year},{d.month:02},{d.day:02},{HIGH[k]},{LOW[k]},0.0", needs="time_column", given={"time_column": ["YEAR", "MN", "DT"], "minimum_column": "MIN", "maximum_column": "MAX"})
hours("niwa", 'Station information:\nName,Agent Number\n"Kelburn",3385\n\nSurface: Hourly\nStation,Date(UTC),Tmax(C),Period(Hrs),Tmin(C),Tgmin(C),Tmean(C),RHmean(%)',
      lambda k, h: f"Kelburn,{h:%Y%m%d:%H%M},{T[k] + 0.5:.1f},1,{T[k] - 0.5:.1f},-,{T[k]},{RH[k]}")
hours("nasa_power", "-BEGIN HEADER-\nNASA/POWER Source Native Resolution Hourly Data \nThe value for missing source data that cannot be computed or is outside of the sources availability range: -999 \nparameter(s): \n" "T2M       MERRA-2 Temperature at 2 Meters (C) \nT2MDEW    MERRA-2 Dew/Frost Point at 2 Meters (C) \n-END HEADER-\nYEAR,MO,DY,HR,T2M,T2MDEW,RH2M",
      lambda k, h: f"{h.year},{h.month},{h.day},{h.hour},{T[k]},{DEW[k]},{RH[k]}")
days("nasa_power_daily", "-BEGIN HEADER-\nT2M_MAX  MERRA-2 Temperature at 2 Meters Maximum (C) \nT2M_MIN  MERRA-2 Temperature at 2 Meters Minimum (C) \n-END HEADER-\nYEAR,DOY,T2M_MAX,T2M_MIN",
      lambda k, d: f"{d.year},{d:%j},{HIGH[k]},{LOW[k]}")

# --- models, and services of the web --------------------------------------------------------------

hours("era5_csv", "valid_time,u10,d2m,t2m,latitude,longitude",
      lambda k, h: f"{h:%Y-%m-%d %H:%M:%S},-3.1,{DEW[k] + 273.15:.2f},{T[k] + 273.15:.2f},52.5,13.25")
hours("era5_index_first", ",time,t2m,skt,stl1",
      lambda k, h: f"{k},{h:%Y-%m-%d %H:%M:%S},{T[k] + 273.15:.4f},{T[k] + 274.15:.4f},280.1")
hours("open_meteo", "latitude,longitude,elevation,utc_offset_seconds,timezone,timezone_abbreviation\n52.52,13.419998,38.0,0,GMT,GMT\n\n" "time,temperature_2m (°C),relative_humidity_2m (%),dew_point_2m (°C),apparent_temperature (°C),soil_temperature_0_to_7cm (°C)",
      lambda k, h: f"{h:%Y-%m-%dT%H:%M},{T[k]},{RH[k]},{DEW[k]},{T[k] - 2:.1f},14.1")
hours("open_meteo_unix", "latitude,longitude\n52.52,13.41\n\ntime,temperature_2m (°C)",
      lambda k, h: f"{(h - datetime(1970, 1, 1)).total_seconds():.0f},{T[k]}", needs="date_format", given={"date_format": "%s"})
hours("visual_crossing", "name,datetime,temp,feelslike,dew,humidity,precip,preciptype,windgust,sealevelpressure,conditions",
      lambda k, h: f'"Berlin, Germany",{h:%Y-%m-%dT%H:%M:%S},{T[k]},{T[k] - 1:.1f},{DEW[k]},{RH[k]}.1,0,,12.1,1013.1,Clear')
days("visual_crossing_daily", "name,datetime,tempmax,tempmin,temp,feelslikemax,feelslikemin,feelslike,dew,sunrise,sunset",
      lambda k, d: f"Berlin,{d:%Y-%m-%d},{HIGH[k]},{LOW[k]},{(LOW[k] + HIGH[k]) / 2:.1f},{HIGH[k]},{LOW[k]},15,9.1,{d:%Y-%m-%d}T04:45:00,{d:%Y-%m-%d}T21:20:00")
hours("wunderground_cells", "Time,Temperature,Dew Point,Humidity,Wind",
      lambda k, h: f"{h:%Y/%m/%d %I:%M %p},{fahrenheit(T[k])} °F,{fahrenheit(DEW[k])} °F,{RH[k]} %,3 mph")
hours("weatherapi", "time_epoch,time,temp_c,temp_f,is_day,feelslike_c,dewpoint_c",
      lambda k, h: f"{(h - datetime(1970, 1, 1)).total_seconds():.0f},{h:%Y-%m-%d %H:%M},{T[k]},{fahrenheit(T[k])},1,{T[k]},{DEW[k]}")
hours("openweather", "dt,dt_iso,timezone,city_name,temp,visibility,dew_point,feels_like,temp_min,temp_max,pressure",
      lambda k, h: f"{(h - datetime(1970, 1, 1)).total_seconds():.0f},{h:%Y-%m-%d %H:%M:%S} +0000 UTC,0,X,{T[k] + 273.15:.2f},10000,{DEW[k] + 273.15:.2f},285.1,{T[k] + 272.15:.2f},{T[k] + 274.15:.2f},1013", needs="unit", given={"unit": "K"})
hours("meteoblue", "location,Basel,Basel\nlat,47.56,47.56\nlon,7.57,7.57\nvariable,Temperature,Relative Humidity\nunit,°C,%\nlevel,2 m elevation corrected,2 m\nresolution,hourly,hourly\naggregation,None,None\n" "timestamp,Basel Temperature [2 m elevation corrected],Basel Relative Humidity [2 m]",
      lambda k, h: f"{h:%Y%m%dT%H%M},{T[k]},{RH[k]}.0")
hours("tmy3", '724010,"RICHMOND INTL AP",VA,-5.0,37.517,-77.317,50\nDate (MM/DD/YYYY),Time (HH:MM),ETR (W/m^2),GHI source,Dry-bulb (C),Dry-bulb source,Dry-bulb uncert (code),Dew-point (C),Dew-point source,RHum (%)',
      lambda k, h: f"{(h - timedelta(hours=1)):%m/%d/%Y},{(h.hour or 24):02}:00,0,1,{T[k]},A,7,{DEW[k]},A,{RH[k]}")
hours("nsrdb", "Source,Location ID,City,Latitude,Longitude,Time Zone,Temperature Units,Clearsky Units\nNSRDB,145809,-,40.57,-105.1,-7,c,w/m2\nYear,Month,Day,Hour,Minute,DHI,DNI,Temperature,Dew Point,Relative Humidity",
      lambda k, h: f"{h.year},{h.month},{h.day},{h.hour},30,0,0,{T[k]},{DEW[k]},{RH[k]}.1", first=HOURS[0] + timedelta(minutes=30), last=HOURS[-1] + timedelta(minutes=30))
hours("merra_tab_doy", "Year\tDOY\tHour\tT_air_C\tRH",
      lambda k, h: f"{h.year}\t{h:%j}\t{h.hour}\t{T[k]}\t{RH[k]}")

# --- loggers --------------------------------------------------------------------------------------

hours("hobo", '"Plot Title: Roof"\n"#","Date Time, GMT+00:00","Temp, °C (LGR S/N: 10343, SEN S/N: 10343, LBL: Temp)","RH, % (LGR S/N: 10343)","Coupler Attached (LGR S/N: 10343)","Host Connected (LGR S/N: 10343)","End Of File (LGR S/N: 10343)"',
      lambda k, h: f"{k + 1},{h:%m/%d/%y %I:%M:%S %p},{T[k]:.3f},{RH[k]}.1,,,", "49,06/02/31 11:20:11 PM,,,Logged,,\n50,06/02/31 11:20:31 PM,,,,Logged,Logged")
hours("hobo_fahrenheit", '"#","Date Time, GMT-05:00","Temp, °F (LGR S/N: 1, SEN S/N: 1)","Intensity, lum/ft² (LGR S/N: 1)"',
      lambda k, h: f"{k + 1},{h:%m/%d/%y %I:%M:%S %p},{fahrenheit(T[k]):.3f},{k}.0")
hours("onset_inTemp", "Line#,Date,Time,Max: Temperature (*C),Avg: Temperature (*C)",
      lambda k, h: f"{k + 1},{h:%m/%d/%Y},{h:%H:%M:%S},{T[k] + 0.2:.1f},{T[k]}", needs="", given={})
hours("toa5", '"TOA5","Station","CR1000","1234","CR1000.Std.32","CPU:prog.CR1","5432","Table1"\n"TIMESTAMP","RECORD","BattV_Avg","PTemp_C_Avg","AirTC_Avg","RH","SlrW_Avg","T_soil_Avg"\n"TS","RN","Volts","Deg C","Deg C","%","W/m^2","Deg C"\n"","","Avg","Avg","Avg","Smp","Avg","Avg"',
      lambda k, h: f'"{h:%Y-%m-%d %H:%M:%S}",{k},12.91,{T[k] + 3:.2f},{T[k]:.2f},{RH[k]},{k}.1,15.2')
hours("weatherlink_cloud", '"WeatherLink Export"\n"Some station"\n\n"Date & Time","Barometer - hPa","Inside Temp - °C","Inside Hum - %","Temp - °C","High Temp - °C","Low Temp - °C","Hum - %","Dew Point - °C","Wet Bulb - °C","Wind Chill - °C","THW Index - °C"',
      lambda k, h: f'"{h:%d/%m/%y %H:%M}","1013.1","21.1","41","{T[k]}","{T[k] + 0.3:.1f}","{T[k] - 0.3:.1f}","{RH[k]}","{DEW[k]}","{T[k] - 2:.1f}","{T[k]}","{T[k]}"')
hours("ecowitt", "Time,Outdoor Temperature(℃),Feels Like(℃),Dew Point(℃),Outdoor Humidity(%),Indoor Temperature(℃),Indoor Humidity(%)",
      lambda k, h: f"{h:%Y-%m-%d %H:%M},{T[k]},{T[k]},{DEW[k]},{RH[k]},21.1,41")
hours("ecowitt_raw", "dateutc,tempinf,humidityin,baromrelin,tempf,humidity,temp1f",
      lambda k, h: f"{h:%Y-%m-%d %H:%M:%S},70.1,41,29.92,{fahrenheit(T[k])},{RH[k]},58.1", needs="temperature_column", given={"temperature_column": "tempf"})
hours("netatmo", 'Name;"Longitude";"Latitude";"ModuleName";"ModuleType"\nHome;"8.1";"47.2";Outdoor;Outdoor\nTimestamp;"Timezone : Europe/Zurich";Temperature;Humidity',
      lambda k, h: f'{(h - datetime(1970, 1, 1)).total_seconds():.0f};"{h:%Y/%m/%d %H:%M:%S}";{T[k]};{RH[k]}')
hours("testo", "Datum/Uhrzeit;[°C] Temperatur;[%rF] Feuchte;[°C] Taupunkt",
      lambda k, h: f"{h:%d.%m.%Y %H:%M:%S};{comma(T[k])};{RH[k]},1;{comma(DEW[k])}", encoding="cp1252")
hours("lascar", "Roof,Time,Celsius(°C),Humidity(%rh),Dew Point(°C),Serial Number",
      lambda k, h: f"{k + 1},{h:%d/%m/%Y %H:%M:%S},{T[k]},{RH[k]}.5,{DEW[k]}" + (",000143311" if k == 0 else ""), encoding="latin-1")
hours("ibutton", "1-Wire/iButton Part Number: DS1922L-F5\nRegistration Number: 8F00\nIs Mission Active?  true\nSample Rate:  Every 3600 second(s)\n\nDate/Time,Unit,Value",
      lambda k, h: f"{h:%m/%d/%y %I:%M:%S %p},C,{T[k]}")
hours("thermochron_tidbit", "Date;Time;Temperature °C",
      lambda k, h: f"{h:%d-%b-%y};{h:%H:%M:%S};{comma(T[k])}")
hours("govee", "Timestamp for sample frequency every 60 min min,Temperature_Celsius,Relative_Humidity",
      lambda k, h: f"{h:%Y-%m-%d %H:%M:%S},{T[k]},{RH[k]}")
hours("tempmate", "Nr.;Datum;Zeit;Temp. [°C];Alarm",
      lambda k, h: f"{k + 1};{h:%d.%m.%Y};{h:%H:%M:%S};{comma(T[k])};")
hours("arduino_epoch", "epoch,temp,vbat",
      lambda k, h: f"{(h - datetime(1970, 1, 1)).total_seconds():.0f},{T[k]},3.91")
hours("influx", "#group,false,false,true\n#datatype,string,long,dateTime:RFC3339\nresult,table,_time,_value,_field",
      lambda k, h: f",0,{h:%Y-%m-%dT%H:%M:%SZ},{T[k]},temperature", needs="temperature_column", given={"temperature_column": "_value"})
hours("grafana", '"Time","temp roof"', lambda k, h: f'"{h:%Y-%m-%d %H:%M:%S}","{T[k]} °C"')
hours("thingspeak", "created_at,entry_id,field1",
      lambda k, h: f"{h:%Y-%m-%d %H:%M:%S} UTC,{k + 1},{T[k]}", needs="temperature_column", given={"temperature_column": "field1"})

# --- programs -------------------------------------------------------------------------------------

hours("series_without_name", ",0", lambda k, h: f"{h:%Y-%m-%d %H:%M:%S},{T[k]}")
hours("r_write_table", '"time" "temp"', lambda k, h: f'"{k + 1}" "{h:%Y-%m-%d %H:%M:%S}" {T[k]}')
hours("excel_german", "Datum;Uhrzeit;Temperatur;Luftdruck",
      lambda k, h: f"{h:%d.%m.%Y};{h:%H:%M};{comma(T[k])};1.013,2", newline="\r\n", encoding="cp1252")
hours("excel_unicode_text", "Date\tTemp °C", lambda k, h: f"{h:%d.%m.%Y %H:%M}\t{T[k]}", encoding="utf-16")
hours("excel_spanish_clock", "Fecha;Temp",
      lambda k, h: f"{h:%d/%m/%Y %I:%M:%S} {'a. m.' if h.hour < 12 else 'p. m.'};{comma(T[k])}")
hours("excel_two_rows_of_names", "Date;Outside;;Inside;\n;Temp;Hum;Temp;Hum",
      lambda k, h: f"{h:%d.%m.%Y %H:%M};{comma(T[k])};{RH[k]};21,1;41")
hours("excel_name_with_line_end", 'Date,"Temp\n(°F)"', lambda k, h: f"{h:%Y-%m-%d %H:%M},{fahrenheit(T[k])}")
hours("markdown_pipes", "time | temp | hum", lambda k, h: f"{h:%Y-%m-%d %H:%M} | {T[k]} | {RH[k]}")
hours("aligned", "date       hour   temp   hum", lambda k, h: f"{h:%Y-%m-%d}  {h:%H:%M}  {T[k]:5}  {RH[k]}")
hours("matlab_names_of_months", "time,T_air", lambda k, h: f"{h:%d-%b-%Y %H:%M:%S},{T[k]}")
hours("german_months", "Zeit;Temperatur", lambda k, h: f"{h.day}. {'Juni'} {h.year} {h:%H:%M};{comma(T[k])}")
hours("french", "Date;Température (°C);Humidité",
      lambda k, h: f"{h:%d/%m/%Y} {h:%H}h{h:%M};{comma(T[k])};{RH[k]}", encoding="latin-1")

hours("gbk", "时间,温度(℃),湿度(%)", lambda k, h: f"{h:%Y/%m/%d %H:%M},{T[k]},{RH[k]}", encoding="gbk")
hours("russian", "Дата;Температура;Влажность",
      lambda k, h: f"{h:%d.%m.%Y %H:%M};{comma(T[k])};{RH[k]}", encoding="cp1251")
add(
    "newest_first",
    lambda: written(
        "time,temp", [f"{h:%d/%m/%Y %H:%M},{T[k]}" for k, h in reversed([*enumerate(HOURS)])]
    ),
)
hours("ds18b20", "time,DS18B20,DHT22_H", lambda k, h: f"{h:%Y-%m-%d %H:%M},{T[k]},{RH[k]}")

hours("mesowest", "# STATION: KSLC\n# LATITUDE: 40.77\nStation_ID,Date_Time,air_temp_set_1,dew_point_temperature_set_1d\n,,Fahrenheit,Fahrenheit",
      lambda k, h: f"KSLC,{h:%m/%d/%Y %H:%M} UTC,{fahrenheit(T[k])},{fahrenheit(DEW[k])}")
hours("rp5", '# Weather station Berlin\n"Local time in Berlin";"T";"Po";"U";"DD";"Tn";"Tx";"Td"',
      lambda k, h: f'"{h:%d.%m.%Y %H:%M}";"{T[k]}";"755.1";"{RH[k]}";"Wind";"";"";"{DEW[k]}";')
hours("nrel_midc", "DATE (MM/DD/YYYY),MST,Tower Dry Bulb Temp [deg C],Tower RH [%],Tower Dew Point Temp [deg C]",
      lambda k, h: f"{h:%m/%d/%Y},{h:%H:%M},{T[k]},{RH[k]},{DEW[k]}")
hours("pangaea", "/* DATA DESCRIPTION:\nCitation: x\n\tTemperature, air [deg C]\n*/\nDate/Time\tSWD [W/m**2]\tT2 [°C]\tRH [%]",
      lambda k, h: f"{h:%Y-%m-%dT%H:%M}\t{k}\t{T[k]}\t{RH[k]}")
hours("fluxnet", "TIMESTAMP_START,TIMESTAMP_END,TA_F,TA_F_QC,SW_IN_F,VPD_F",
      lambda k, h: f"{h:%Y%m%d%H%M},{h + timedelta(hours=1):%Y%m%d%H%M},{T[k]},0,{k},3.1")
hours("acurite", "Timestamp,Outdoor Temperature,Dew Point,Heat Index,Barometric Pressure",
      lambda k, h: f"{h:%m/%d/%Y %H:%M},{fahrenheit(T[k])},{fahrenheit(DEW[k])},70,29.92", needs="unit", given={"unit": "F"})
hours("tinytag", 'Series 1,,\nProperty,"Temperature",\nRecord Number,Time,Ch 1 Temperature (°C)',
      lambda k, h: f"{k + 1},{h:%d %b %Y %H:%M:%S},{T[k]} °C")
hours("kestrel", "Time,Temp,Wet Bulb Temp.,Rel. Hum.,Baro.\nhh:mm:ss dd/mm/yyyy,°F,°F,%,inHg",
      lambda k, h: f"{h:%d/%m/%Y %H:%M:%S},{fahrenheit(T[k])},55,{RH[k]},29.9")
hours("delta_t", "Label,Air Temp,RH,Rad\nUnits,deg C,%,kW.m-2\nDate/Time,,,",
      lambda k, h: f"{h:%d/%m/%Y %H:%M:%S},{T[k]},{RH[k]},0")
hours("zentra", "z6-00001,Port 1,Port 1\n48 records,ATMOS 14,ATMOS 14\nTimestamps, °C Air Temperature, RH Relative Humidity",
      lambda k, h: f"{h:%m/%d/%Y %I:%M:%S %p},{T[k]},0.{RH[k]}")
hours("tomst_without_names", "",
      lambda k, h: f"{k};{h:%Y.%m.%d %H:%M};4;{T[k]};{T[k] + 1:.2f};{T[k] + 2:.2f};240;202;0", needs="temperature_column", given={"temperature_column": "4"})
days("daymet", "Latitude: 35.9\nHow to cite: x\nyear,yday,dayl (s),prcp (mm/day),tmax (deg c),tmin (deg c)",
      lambda k, d: f"{d.year},{d:%j},34571.1,0.0,{HIGH[k]},{LOW[k]}")
days("prism", "PRISM Time Series Data\nDate,tmin (degrees F),tmax (degrees F)",
      lambda k, d: f"{d:%Y-%m-%d},{fahrenheit(LOW[k])},{fahrenheit(HIGH[k])}")
hours("argentina", "FECHA   HORA  TEMP   HUM", lambda k, h: f"{h:%d%m%Y} {h.hour:5} {T[k]:5} {RH[k]:4}")
hours("estonia", "Aasta,Kuu,Päev,Kell (UTC),Õhutemperatuur °C,Suhteline õhuniiskus %",
      lambda k, h: f"{h.year},{h.month},{h.day},{h:%H:%M},{T[k]},{RH[k]}")
days("zamg", "time,station,tlmin,tlmax,tl_mittel",
      lambda k, d: f"{d:%Y-%m-%dT%H:%M}+00:00,5904,{LOW[k]},{HIGH[k]},15")
hours("imgw_with_names", "Kod stacji;Rok;Miesiąc;Dzień;Godzina;Temperatura powietrza [°C];Temperatura termometru zwilżonego [°C];Temperatura punktu rosy [°C]",
      lambda k, h: f"1;{h.year};{h.month};{h.day};{h.hour};{T[k]};9;{DEW[k]}")
hours("hobo_without_quotes", "#,Date Time, GMT+00:00,Temp, °C,RH, %",
      lambda k, h: f"{k + 1},{h:%m/%d/%y %I:%M:%S %p},{T[k]},{RH[k]}", needs="delimiter")
hours("decimal_commas_unquoted", "time,temp,hum",
      lambda k, h: f"{h:%Y-%m-%d %H:%M},{comma(T[k])},{RH[k]}", needs="delimiter")
hours("decimals_in_a_column_without_name", "time,temp,",
      lambda k, h: f"{h:%Y-%m-%d %H:%M},{comma(T[k])}", needs="delimiter")
hours("thousandths", "time,temp_mdegC",
      lambda k, h: f"{h:%Y-%m-%d %H:%M},{round(1000 * T[k])}", needs="unit", given={"unit": "C", "scale": "0.001"})
hours("first_time_missing", "time,temp",
      lambda k, h: f"{h:%Y-%m-%d %H:%M},{T[k]}" if k else "?,10.5", needs="line 2")
hours("clock_without_date", "time,temp", lambda k, h: f"{h:%H:%M},{T[k]}", needs="date_format")
hours("excel_serial_days", "Date,Temp", lambda k, h: f"{48000 + k / 24:.6f},{T[k]}", needs="date_format")
hours("soil_alone", "time,T_soil",
      lambda k, h: f"{h:%Y-%m-%d %H:%M},{T[k]}", needs="temperature_column", given={"temperature_column": "T_soil"})
hours("indoor_alone", "time,Indoor Temperature (C)",
      lambda k, h: f"{h:%Y-%m-%d %H:%M},{T[k]}", needs="temperature_column", given={"temperature_column": "Indoor Temperature (C)"})
hours("percentiles", "time,temp_median,temp_p10,temp_p90",
      lambda k, h: f"{h:%Y-%m-%d %H:%M},{T[k]},{T[k] - 1:.1f},{T[k] + 1:.1f}", needs="temperature_column", given={"temperature_column": "temp_median"})

# --- adversaries ----------------------------------------------------------------------------------

hours("dew_first", "time,Dew Point Temperature,Wet Bulb Temperature,Temperature",
      lambda k, h: f"{h:%Y-%m-%dT%H:%M},{DEW[k]},{DEW[k] + 1:.1f},{T[k]}")
hours("inside_outside", "time;Innentemperatur;Außentemperatur",
      lambda k, h: f"{h:%Y-%m-%dT%H:%M};21.{k % 10};{T[k]}")
hours("setpoint", "time,Temp setpoint,Temp alarm,Temp", lambda k, h: f"{h:%Y-%m-%dT%H:%M},20.0,40.0,{T[k]}")
hours("tenths_in_name", "time,temp_tenths_of_degC", lambda k, h: f"{h:%Y-%m-%dT%H:%M},{tenths(T[k])}")
add("one_day_ambiguous", lambda: written("time,temp", [f"{h:%d/%m/%Y %H:%M},{t}" for h, t in zip(HOURS[:24], T, strict=False)], readings=24,
    last=HOURS[23], low=min(T[:24]), high=max(T[:24]), needs="date_format", given={"date_format": "%d/%m/%Y %H:%M"}))
add("twelve_days_ambiguous", lambda: written("date,temp", [f"{d:%m/%d/%Y},{t}" for d, t in zip(DAYS[:12], HIGH, strict=False)], readings=12,
    first=DAYS[0], last=DAYS[11], low=min(HIGH[:12]), high=max(HIGH[:12]), needs="date_format", given={"date_format": "%m/%d/%Y"}))
hours("two_digit_years", "time,temp", lambda k, h: f"{h:%d.%m.%y %H:%M},{T[k]}")
hours("year_first_short", "time,temp", lambda k, h: f"{h:%y-%m-%d %H:%M},{T[k]}")
hours("hours_hhmm", "date,time,temp", lambda k, h: f"{h:%Y-%m-%d},{h:%H%M},{T[k]}")
hours("jahr_monat_tag", "Jahr;Monat;Tag;Stunde;Temperatur",
      lambda k, h: f"{h.year};{h.month};{h.day};{h.hour};{comma(T[k])}")
hours("weekday", "time,temp", lambda k, h: f"{h:%a %d %b %Y %H:%M},{T[k]}")
hours("rfc", "time,temp", lambda k, h: f'"{h:%a, %d %b %Y %H:%M:%S} GMT",{T[k]}')
hours("soil_beside", "time,soil temp,air temp,grass temp",
      lambda k, h: f"{h:%Y-%m-%d %H:%M},15.1,{T[k]},{T[k] - 2:.1f}")
hours("pressure_alone", "time,pressure",
      lambda k, h: f"{h:%Y-%m-%d %H:%M},{T[k]}", needs="temperature_column", given={"temperature_column": "pressure"})
hours("unknown_name", "time,qx1",
      lambda k, h: f"{h:%Y-%m-%d %H:%M},{T[k]}", needs="temperature_column", given={"temperature_column": "qx1"})
hours("temps_is_time", "Temps;Température", lambda k, h: f"{h:%Y-%m-%d %H:%M};{T[k]}")
days("two_stems", "date,TX,TN,TG_max,TG_min",
      lambda k, d: f"{d:%Y-%m-%d},{HIGH[k]},{LOW[k]},30.1,5.1", needs="minimum_column", given={"minimum_column": "TN", "maximum_column": "TX"})
months("monthly", "month,temp", lambda k, m: f"{m:%Y-%m},{5 + k % 12}.5", 5.5, 16.5)

# --- layouts found by an adversary ----------------------------------------------------------------


def lost(k: int, code: object) -> object:
    return code if k in (7, 8, 9, 30) else T[k]


days("ghcn_superset", 'ID,DATE,ELEMENT,DATA_VALUE,M_FLAG,Q_FLAG,S_FLAG,OBS_TIME',
  lambda k,d: f'GME00122614,{d:%Y%m%d},TMAX,{tenths(HIGH[k])},,,E,', needs="temperature_column",given={"temperature_column":"DATA_VALUE","scale":"0.1"}, **one_a_day())
hours("meteoswiss_ogd", "station_abbr;reference_timestamp;tre200h0;tre200hn;tre200hx;ure200h0;rre150h0",
  lambda k,h: f"BAS;{h:%d.%m.%Y %H:%M};{T[k]};{T[k]-.4:.1f};{T[k]+.4:.1f};{RH[k]};0")
days("imgw_no_header", "", lambda k,d: f'"352200375","WARSZAWA-OKĘCIE","{d:%Y","%m","%d}",{HIGH[k]:.1f},"",{LOW[k]:.1f},"",{(HIGH[k]+LOW[k])/2:.1f},"",{LOW[k]-2:.1f},"",.0,"9",""', encoding="cp1250", needs="time_column", given={"time_column":["3","4","5"],"maximum_column":"6","minimum_column":"8"})
hours("davis_ampm", "\t\tTemp\tHi\tLow\tOut\tDew\tWind\tWind\tIn\nDate\tTime\tOut\tTemp\tTemp\tHum\tPt.\tSpeed\tDir\tTemp",
  lambda k,h: f"{h.day}/{h.month}/{h:%y}\t{h:%I:%M}{'a' if h.hour<12 else 'p'}\t{T[k]}\t{T[k]+.4:.1f}\t{T[k]-.4:.1f}\t{RH[k]}\t{DEW[k]}\t3.2\tNW\t21.5")
hours("netatmo_quoted", 'Name;"Lat";"Long";"ModuleName";"ModuleType"\nHome;2.1;48.1;Outdoor;Outdoor module\nTimestamp;"Timezone : Europe/Paris";Temperature;Humidity',
  lambda k,h: f'{1938038400+3600*k+6*0};"{h:%Y/%m/%d %H:%M:%S}";{T[k]};{RH[k]}')
hours("logtag_elapsed", '"Serial number","A0HK123456"\n"Start time","6/1/2031 12:00:00 AM"\n\n"Index","Date","Time","Elapsed time","Reading (°C)","Events"',
  lambda k,h: f'{k+1},{h:%d %b %Y},{h:%H:%M:%S},{k//24}.{h:%H:%M:%S},{T[k]},')
hours("thermopro", "Datetime,Temperature_Fahrenheit(°F),Humidity(%)", lambda k,h: f"{h:%m/%d/%Y %H:%M},{fahrenheit(T[k])},{RH[k]}")
hours("shelly", "timestamp,temperature_tC,temperature_tF,humidity", lambda k,h: f"{1938038400+3600*k},{T[k]},{fahrenheit(T[k])},{RH[k]}")
hours("home_assistant_state", "entity_id,state,last_changed", lambda k,h: f"sensor.outdoor_temperature,{'unavailable' if k==11 else T[k]},{h:%Y-%m-%dT%H:%M:%S}.000Z", missing=1, needs="temperature_column", given={"temperature_column":"state"})
hours("esphome_log", "time;id;Temperature [°C];WiFi Signal [dBm];Internal Temperature [°C]", lambda k,h: f"{h:%Y-%m-%d %H:%M:%S};roof;{lost(k,'nan')};-71;{T[k]+12:.1f}", missing=4)
TM="723860,\"LAS VEGAS\",NV,-8.0,36.083,-115.150,648\nDate (MM/DD/YYYY),Time (HH:MM),ETR (W/m^2),GHI (W/m^2),Dry-bulb (C),Dry-bulb source,Dry-bulb uncert (code),Dew-point (C),Dew-point source,RHum (%)"
hours("excel_serial_datum", "Datum;Temperatur", lambda k,h: f"{48000+k},{comma(T[k])}".replace(",",";",1), needs="pandas")
hours("fmi_quoted", '"Havaintoasema","Vuosi","Kuukausi","Päivä","Aika [Paikallinen aika]","Lämpötilan keskiarvo [°C]"', lambda k,h: f'"Helsinki Kaisaniemi","{h.year}","{h.month}","{h.day}","{h:%H:%M}","{T[k]}"')
hours("metno_frost", "sourceId,referenceTime,elementId,value,unit,timeOffset,qualityCode", lambda k,h: f"SN18700:0,{h:%Y-%m-%dT%H:%M:%S}.000Z,air_temperature,{T[k]},degC,PT0H,0")
hours("sensorpush_dew", '"Timestamp (America/New_York)","Temperature (°F)","Dew Point (°F)","Barometric Pressure (inHg)"', lambda k,h: f'"{h:%Y-%m-%d %H:%M}","{fahrenheit(T[k])}","{fahrenheit(DEW[k])}","29.9"')
hours("ruuvi", "Date,Temperature (°C),Relative humidity (%),Battery voltage (V)", lambda k,h: f"{h:%d/%m/%Y %H:%M:%S},{T[k]},{RH[k]},2.9")
hours("arpa_it", "Idsensore;Data-Ora;Valore;Stato", lambda k,h: f"2001;{h:%d/%m/%Y %H:%M};{comma(T[k])};VA", needs="temperature_column", given={"temperature_column": "Valore"})
days("roc_tw", "觀測時間(day),氣溫(℃),最高氣溫(℃),最低氣溫(℃)", lambda k,d: f"{d:%Y-%m-%d},{(HIGH[k]+LOW[k])/2:.1f},{HIGH[k]},{LOW[k]}")
hours("kelvin_unit_row", "time,tas,pr\nUTC,K,mm", lambda k,h: f"{h:%Y-%m-%dT%H:%M:%SZ},{T[k]+273.15:.2f},0.0")
hours("deg_c_x10", "time,temp_x10_degC", lambda k,h: f"{h:%Y-%m-%d %H:%M},{tenths(T[k])}", needs="scale = 0.1", given={"scale":"0.1"})
for place, words in enumerate(("unavailable,unavailable,error", "sensor restart,n/a,fault", "start,temp,roof")):
    add(f"text_row_{place}", lambda place=place, words=words: hourly("time,temperature,status",
        lambda k, h: (f"{words}\n" if k == place else "") + f"{h:%Y-%m-%d %H:%M},{T[k]},ok", needs="line" if place else ""))
    add(f"text_cell_{place}", lambda place=place: hourly("time,temperature,status",
        lambda k, h: f"{h:%Y-%m-%d %H:%M},{'error' if k == place else T[k]},ok", missing=1))


LONG = [BEGIN + timedelta(hours=k) for k in range(480)]
LONG_T = [T[k % 48] for k in range(480)]


def coded(
    code: str,
    places: Sequence[int],
    *,
    scale: int = 1,
    head: str = "time,temperature",
    **about: Any,
) -> File:
    """Return twenty days of hours with a code for missing."""
    rows = [
        f"{h:%Y-%m-%dT%H:%M},{code if k in places else tenths(LONG_T[k]) if scale == 10 else LONG_T[k]}"
        for k, h in enumerate(LONG)
    ]
    return written(head, rows, readings=480, last=LONG[-1], missing=len(places), **about)


RUNS = {"one": [77], "three": [60, 61, 62], "day": [*range(100, 124)], "several": [*range(40, 47), 99, *range(300, 340)],
        "every_other": [*range(101, 200, 2)], "long": [*range(200, 320)]}
CODES = ("99.9", "999.9", "-9999", "85", "-88.8", "32767", "-99", "-999.0", "9999", "-127", "888.8", "NA", "", "M", "---", "nan", "-32768", "1e20", "6999")
for code in CODES:
    for run, places in RUNS.items():
        CODED[f"{code or 'empty'}_{run}"] = lambda code=code, places=places: coded(code, places)
CODED["tenths"] = lambda: coded(
    "-9999", RUNS["several"], scale=10, head="# temperature in 0.1 °C\ntime,temperature"
)
CODED["tenths_999"] = lambda: coded(
    "999", RUNS["several"], scale=10, head="# temperature in 0.1 °C\ntime,temperature"
)


@layout
def zipped() -> File:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("produkt.txt", LAYOUTS["dwd_hourly"]().content)
    return File(packed.getvalue(), ending=".zip")


@layout
def packed_by_gzip() -> File:
    return File(gzip.compress(LAYOUTS["hobo"]().content), ending=".csv.gz")


@layout
def utf_16_without_mark() -> File:
    return File(LAYOUTS["series_without_name"]().content.decode().encode("utf-16-le"))


# --- layouts that nobody has thought of -----------------------------------------------------------

FORMATS = ("%Y-%m-%d %H:%M", "%Y-%m-%dT%H:%M:%S", "%d.%m.%Y %H:%M", "%d/%m/%Y %H:%M", "%m/%d/%Y %I:%M %p",
           "%d.%m.%y %H:%M", "%Y%m%d%H%M", "%d-%b-%Y %H:%M", "%Y/%m/%d %H:%M:%S")
UNITS: dict[str, Callable[[float], float]] = {
    " (°C)": float, " [degC]": float, "_C": float, "": float, " (F)": fahrenheit, " °F": fahrenheit,
    " [K]": lambda value: round(value + 273.15, 2), " (0.1 °C)": tenths,
}
NAMES = (
    "temp",
    "Temperature",
    "T_air",
    "AirT",
    "Lufttemperatur",
    "Temperatura",
    "t2m_mean",
    "Tair",
    "outdoor temp",
)
OTHERS: dict[str, Callable[[int], Any]] = {
    "Dew Point": lambda k: DEW[k], "Humidity (%)": lambda k: RH[k], "Battery (V)": lambda k: 3.91, "wind speed": lambda k: k % 7,
    "Indoor Temperature": lambda k: 21.1, "Temp quality": lambda k: 1, "wet bulb": lambda k: DEW[k] + 1, "feels like": lambda k: T[k] + 2,
    "Pressure": lambda k: 1013.2, "#": lambda k: k + 1, "remark": lambda k: "ok", "station": lambda k: 433, "Soil temp": lambda k: 14.1,
}


def drawn(random: Any) -> File:
    """Return hours of weather in a layout that a random generator makes up."""
    written_as, unit, name = random.choice(FORMATS), random.choice([*UNITS]), random.choice(NAMES)
    delimiter, sign = random.choice(
        [(",", "."), (";", ","), (";", "."), ("\t", "."), ("\t", ","), ("|", ".")]
    )
    columns: list[tuple[str, Callable[[int], str]]] = [
        (name + unit, lambda k: f"{UNITS[unit](T[k])}".replace(".", sign))
    ]
    for other in random.sample([*OTHERS], random.randint(0, 5)):
        columns.append((other, lambda k, other=other: f"{OTHERS[other](k)}".replace(".", sign)))
    random.shuffle(columns)
    columns.insert(
        random.choice([0, 0, len(columns)]),
        ("Date" if random.random() < 0.5 else "time", lambda k: f"{HOURS[k]:{written_as}}"),
    )
    quote = random.choice(['"', "", ""])
    head = random.choice(["", "", "Station: X\n\n", "# made by somebody\n", "sep=;\n"])
    head += delimiter.join(f"{quote}{title}{quote}" for title, _ in columns)
    rows = [delimiter.join(f"{quote}{cell(k)}{quote}" for _, cell in columns) for k in range(48)]
    end = random.choice(["", "", "mean" + delimiter * (len(columns) - 1), "(c) somebody"])
    near = 0.06 if UNITS[unit] is fahrenheit else 0.051
    return written(head, rows, end, newline=random.choice(["\n", "\r\n"]),
                   encoding=random.choice(["utf-8", "utf-8-sig", "latin-1", "utf-16"]), near=near)
